// SPDX-License-Identifier: MIT
#pragma once

#include <variant>

#include "ftcs/clock/cycle_timer.h"
#include "ftcs/clock/steering_history.h"
#include "ftcs/discipline/cycle_servo_types.h"
#include "ftcs/servo/in_order.h"

namespace ftcs {

/// Stands in for the adaptive servo where its code shall not be linked.
struct NoAdaptiveServo {
  explicit NoAdaptiveServo(const AdaptiveConfig&) noexcept {}
  ServoUpdate update(const TimestampPair&, const ClockReading&) noexcept { return {}; }
  void reset() noexcept {}
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return {}; }
};

/// What one frame told of the phase: the reference showed so much when the steered clock did, both
/// at the instant `stamp` of the host. E = local - reference, the transit taken off.
struct CyclePhase {
  ReferenceTime reference;
  LocalTime local;
  FreeRunningTime stamp;  ///< of both
};

/// What the cycle has to know of its law.
struct CycleLawTraits {
  bool once_per_sync = false;  ///< takes one good sample an interval
  bool every_cycle = false;    ///< takes each, and weighs it itself
  /// After so many commands it knows the rate.
  std::uint32_t commands_to_rate = 0;
};

/// The laws of a cycle: alternatives of one variant.
struct FreeCycleLaw {
  static constexpr CycleLawTraits kTraits{};
  ServoUpdate update(const CyclePhase&, const ClockReading&) noexcept { return {}; }
  void reset() noexcept {}
};
/// One good sample in cycles_per_sync, as FTCS and PICS do it: a forward sample without a path
/// delay, for the transit is taken off already.
template <class Servo, std::uint32_t commands_to_rate>
struct SampledCycleLaw {
  template <class Config>
  explicit SampledCycleLaw(const Config& config) noexcept : servo(config) {}
  static constexpr CycleLawTraits kTraits{true, false, commands_to_rate};
  ServoUpdate update(const CyclePhase& phase, const ClockReading& now) noexcept {
    return servo.update(SyncSample{phase.reference, Duration{}, phase.local, phase.stamp}, now);
  }
  void reset() noexcept { servo.reset(); }
  Servo servo;
};
/// Each cycle a backward message: the frame left here and was stamped at the reference.
template <class Servo>
struct MessageCycleLaw {
  explicit MessageCycleLaw(const AdaptiveConfig& config) noexcept : servo(config) {}
  static constexpr CycleLawTraits kTraits{false, true, 2};
  ServoUpdate update(const CyclePhase& phase, const ClockReading& now) noexcept {
    return servo.update({Direction::kBackward, phase.reference, phase.local, phase.stamp}, now);
  }
  void reset() noexcept { servo.reset(); }
  Servo servo;
};

/// Keeps a cyclic task in phase with a reference clock that only its own frames can read: Section V
/// of the paper, eq. 25 (FTCS) and 26 (PICS) on a cycle timer, or the adaptive servo every cycle.
///
/// The steered clock is the count of cycles: it shows m * cycle + shift at the m-th trigger, so
/// that its offset from the reference is E, early positive. Each frame is a backward pair: local =
/// what the steered clock showed when it was sent, reference = latch minus transit. Hence the
/// sender's lateness enters with its sign (E = -phase(t_ref - lateness)) and the tick of the timer
/// with it.
///
/// k(n) is formed from unwrapped reference time: a phase alone, modulo the cycle, locks happily to
/// a rate that is wrong by one cycle per interval. A value; nothing waits, nothing allocates.
///
///     CycleServo servo(CycleServoConfig{});               // examples/05_cycle_servo.cpp
///     CycleDecision next = servo.start(now());
///     for (;;) {
///       sleep_until(next.wake);                           // CLOCK_MONOTONIC, nobody steers it
///       const CycleSample seen = exchange_frame();        // stamps, and 0x0910 of the reference
///       next = servo.update(seen, now());
///     }
///
/// On the way from a sample to the next trigger:
///
///     gates      a late sender, a slow frame, a lost one: coasted over, at the last rate
///     anchor     the first good sample sets the steered clock; the phase is that of `shift`
///     E          local_at(sent) - (reference - transit), early positive
///     doubt      a phase unlike its neighbours': the next cycle is asked, five are the truth
///     law        FTCS, PICS: one sample in cycles_per_sync; adaptive: all. Rates within F
///     trigger    the next multiple of the cycle on the steered clock, on the timer's grid
///
/// Three phases in a row beyond three quarters of a cycle mean that the reference has restarted:
/// anchored anew. Constant work but for two medians of 32 values where a phase decides something;
/// one thread.
template <class Adaptive>
class BasicCycleServo {
 public:
  /// Valid: what CycleServoConfig says of its fields; nothing is checked here (the C interface
  /// does, ftcs_cycle_init()).
  explicit BasicCycleServo(const CycleServoConfig& config) noexcept;

  /// The first trigger: one cycle from now. Everything known of a phase is void; counters stay.
  [[nodiscard]] CycleDecision start(FreeRunningTime now) noexcept;
  /// A cycle is over: what its frame told, at `now`. Returns the next trigger, which lies after
  /// `now`: cycles that a stall passed over are counted in `skipped` and not made up for.
  /// start() comes first.
  [[nodiscard]] CycleDecision update(const CycleSample& sample, FreeRunningTime now) noexcept;

  [[nodiscard]] const CycleServoCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] const CycleServoConfig& config() const noexcept { return config_; }
  /// Reference time that the steered clock believes in at an instant of the host; before the first
  /// good sample it counts from start().
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept {
    return history_.local_at(instant);
  }
  /// Number of the coming trigger on the grid of reference time.
  [[nodiscard]] CycleTrigger next_trigger() const noexcept { return trigger_; }

 private:
  [[nodiscard]] CycleVerdict judge(const CycleSample& sample) const noexcept;
  void count(CycleVerdict verdict) noexcept;
  void anchor(const CycleSample& sample, FreeRunningTime stamp) noexcept;
  void follow(const CycleSample& sample, FreeRunningTime stamp, FreeRunningTime now) noexcept;
  [[nodiscard]] bool doubtful(Duration error) noexcept;
  [[nodiscard]] bool sample_due() const noexcept;
  [[nodiscard]] CycleLawTraits traits() const noexcept;
  [[nodiscard]] ServoUpdate ask_law(const CycleSample& sample, FreeRunningTime stamp,
                                    LocalTime local, FreeRunningTime now) noexcept;
  void apply(const ServoCommand& command, FreeRunningTime now) noexcept;
  void restart_law() noexcept;
  [[nodiscard]] bool rate_known() const noexcept;
  [[nodiscard]] FreeRunningTime scheduled_of(const CycleSample& sample) const noexcept;
  [[nodiscard]] FreeRunningTime stamp_of(const CycleSample& sample) const noexcept;
  [[nodiscard]] CycleDecision decide(FreeRunningTime now) noexcept;

  CycleServoConfig config_;
  /// FTCS knows the rate with its first command, the others learn it from the second on.
  using Law = std::variant<FreeCycleLaw, SampledCycleLaw<FtcsServo, 1>,
                           SampledCycleLaw<PicsServo, 2>, MessageCycleLaw<Adaptive>>;
  Law law_;
  SteeringHistory history_;
  CycleTimer timer_;
  LockDetector lock_;
  OutlierGate gate_;        ///< of the phase error: the steered clock predicts that there is none
  CycleTrigger trigger_{};  ///< of the cycle under way
  CycleDecision decision_{};
  CycleServoCounters counters_{};
  bool anchored_ = false;
  std::uint32_t commands_ = 0;      ///< of the law since it started
  std::uint32_t until_sync_ = 0;    ///< cycles until FTCS or PICS takes its next sample
  std::uint32_t coasting_ = 0;      ///< cycles without a usable sample
  std::uint32_t out_of_phase_ = 0;  ///< consecutive samples further off than half a cycle
};

using CycleServo = BasicCycleServo<AdaptiveServo>;
extern template class BasicCycleServo<AdaptiveServo>;

}  // namespace ftcs
