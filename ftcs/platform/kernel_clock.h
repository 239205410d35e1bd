// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/steering_history.h"
#include "ftcs/platform/clock_device.h"
#include "ftcs/platform/rate_steps.h"

namespace ftcs::platform {

/// What others did to a clock that we steer, since the last time somebody asked.
struct ForeignSteering {
  std::optional<Rate> expected_rate{};  ///< another program changed the frequency: what we had set
  std::optional<Rate> found_rate{};     ///< and what the kernel held instead
  std::optional<Duration> step{};       ///< the clock was set: by how much it leapt
  int leap = 0;  ///< +1: the kernel inserted the announced leap second, -1: it left one out
};

/// A clock of the kernel as an AdjustableClock.
///
/// The kernel shows the steered face only. The free-running face of CLOCK_REALTIME is
/// CLOCK_MONOTONIC_RAW, the same oscillator, and its steered face is what was commanded: the kernel
/// keeps to that on average, a few nanoseconds off in between, which it makes good by itself.
/// The free-running face of a PTP hardware clock is rebuilt by taking the
/// commands back (SteeringHistory), each placed between two readings. A kernel keeps no expiry, so
/// that a correction is ended by whoever runs the loop: wake at expiry() (wait_for_expiry_ns()) and
/// call read(), which ends what is due. Lateness is accounted for, not assumed away: the history
/// holds the moment at which the rate changed.
///
/// The clock is not touched before the first apply(). One thread.
class KernelClock final : public AdjustableClock, public FreeRunningSource {
 public:
  /// `limits`: narrowed by the device's own. `may_steer` false: apply() is refused, always.
  explicit KernelClock(ClockDevice device, const RateLimits& limits = {}, bool may_steer = true);

  [[nodiscard]] ClockReading read() noexcept override;
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept override {
    return history_.local_at(instant);
  }
  [[nodiscard]] RateLimits rate_limits() const noexcept override { return limits_; }
  [[nodiscard]] Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept override;
  [[nodiscard]] Duration expiry_lateness() const noexcept override { return lateness_; }
  [[nodiscard]] FreeRunningTime now() noexcept override { return read().free_running; }

  /// A timestamp that was taken from this clock, on its free-running face. No value: it is older
  /// than a step that somebody else made, or from the future.
  [[nodiscard]] std::optional<FreeRunningTime> from_stamp(std::int64_t clock_ns) noexcept;

  /// What the clock itself shows, on the timescale of local time.
  [[nodiscard]] LocalTime local_of(std::int64_t clock_ns) const noexcept {
    return LocalTime{Duration::from_whole_ns(clock_ns) + timescale_offset_};
  }
  /// When the running correction has to end; no value: none runs.
  [[nodiscard]] std::optional<FreeRunningTime> expiry() const noexcept { return end_; }
  /// How long to sleep on CLOCK_MONOTONIC, which may be steered along with this clock: never too
  /// long, so that a second, shorter sleep may be needed.
  [[nodiscard]] std::optional<std::int64_t> wait_for_expiry_ns() noexcept;
  /// Ends a correction at once; the clock keeps the tracking rate.
  void settle() noexcept;
  /// Ends a correction at once and leaves a clock that was steered at this rate, before the program
  /// ends.
  void settle_at(Rate rate) noexcept;
  /// Has a command been applied?
  [[nodiscard]] bool is_steered() const noexcept { return has_steered_; }
  /// What holds when no correction runs; at first what the kernel held.
  [[nodiscard]] Rate tracking_rate() const noexcept { return tracking_rate_; }

  /// What local time is ahead of the clock's own reading by: TAI - UTC for CLOCK_REALTIME that
  /// follows a TAI reference. A change moves local time.
  void set_timescale_offset(Duration ahead) noexcept;
  [[nodiscard]] Duration timescale_offset() const noexcept { return timescale_offset_; }
  /// A leap second at the end of the day: +1 the kernel will insert one, -1 leave one out, 0 none.
  /// When the clock then leaps, local time goes on.
  void expect_leap(int leap) noexcept { expected_leap_ = leap; }
  /// Makes the leap itself, where the kernel is not asked to. Local time goes on.
  [[nodiscard]] std::optional<ClockError> leap_now(int leap) noexcept;

  /// How long the free-running face has gone on while the machine slept, as the machine counts it.
  [[nodiscard]] Duration ran_asleep() const noexcept { return ran_asleep_; }

  /// Asks the kernel whether its frequency is still ours, and reports that and everything else
  /// once.
  [[nodiscard]] ForeignSteering take_foreign_steering() noexcept;
  /// How often somebody else has stepped the clock.
  [[nodiscard]] std::uint64_t foreign_steps() const noexcept { return foreign_steps_; }
  /// How often somebody else has changed its frequency; as far as was seen.
  [[nodiscard]] std::uint64_t foreign_rates() const noexcept { return foreign_rates_; }
  /// Set for good once the device is gone, or cannot be read for ten seconds.
  [[nodiscard]] std::optional<ClockError> failure() const noexcept { return failure_; }
  [[nodiscard]] ClockDevice& device() noexcept { return device_; }
  [[nodiscard]] const ClockDevice& device() const noexcept { return device_; }

 private:
  /// A reading against what the commands say.
  struct Deviation {
    FreeRunningTime instant;  ///< of the reading, by CLOCK_MONOTONIC_RAW
    Duration by;
    bool is_step = false;  ///< both readings' widths and all drift in between do not explain it
  };

  [[nodiscard]] Result<ClockDevice::Reading, ClockError> read_device() noexcept;
  [[nodiscard]] bool look() noexcept;
  [[nodiscard]] bool go_on_unread() noexcept;
  // Since the last look; two readings a moment apart tell it. CLOCK_MONOTONIC_RAW stood still.
  [[nodiscard]] std::int64_t newly_slept_ns() noexcept {
    constexpr std::int64_t kShortestNs = 1'000'000;
    const std::int64_t newly = device_.slept_ns() - slept_ns_;
    if (newly < kShortestNs) return 0;
    slept_ns_ += newly;
    return newly;
  }
  [[nodiscard]] Deviation deviation_of(const ClockDevice::Reading& now) const noexcept;
  [[nodiscard]] std::optional<ClockError> confirm_step(ClockDevice::Reading& now) noexcept;
  void take(const ClockDevice::Reading& now, FreeRunningTime instant) noexcept;
  [[nodiscard]] FreeRunningTime free_at_raw(std::int64_t raw_ns) const noexcept;
  [[nodiscard]] double anchor_doubt_ns(std::int64_t raw_ns) const noexcept;
  // An interrupt came in between.
  [[nodiscard]] bool is_wide(std::int64_t width_ns) const noexcept {
    constexpr std::int64_t kUsualSpread = 4;
    return width_ns > kUsualSpread * device_.quickest_ns();
  }
  [[nodiscard]] Duration not_made_good(Duration deviation,
                                       std::int64_t elapsed_raw_ns) const noexcept;
  [[nodiscard]] Duration beyond_bracket(Duration deviation,
                                        const ClockDevice::Reading& reading) const noexcept;
  void learn_width(std::int64_t width_ns) noexcept;
  void learn_gain(Duration deviation, const ClockDevice::Reading& now) noexcept;
  void forget_gain_interval() noexcept;
  void note_leap_or_step(const Deviation& deviation, const ClockDevice::Reading& now) noexcept;
  void check_rate() noexcept;
  [[nodiscard]] std::optional<ClockError> change_rate(Rate rate, Duration step) noexcept;
  [[nodiscard]] Rate settable(Rate rate) const noexcept;
  [[nodiscard]] Result<Rate, ClockError> command(Rate rate, Duration step) noexcept;
  void place_change(const ClockDevice::Reading& after, double doubt_ns) noexcept;
  void end_correction() noexcept;
  // The greatest of the last corrections', forgotten by a sixteenth with each of them; also with
  // those that a command replaced, or one that is made longer for it would never end and be asked.
  // A machine that stood still for longer than a second says nothing of the next correction.
  void note_lateness(Duration late) noexcept {
    constexpr double kKept = 15.0 / 16.0;
    constexpr Duration kMost = Nanoseconds{1'000'000'000};
    const Duration kept = Duration::from_ns(kKept * lateness_.ns());
    lateness_ = std::max(std::min(late, kMost), kept);
  }

  ClockDevice device_;
  RateLimits limits_;
  bool may_steer_;
  Duration timescale_offset_{};
  SteeringHistory history_;
  Rate held_rate_{};  // what the kernel should hold
  bool has_steered_ = false;
  ClockReading latest_{};  // of the last look at the device
  std::int64_t latest_raw_ns_ = 0;
  std::int64_t latest_width_ns_ = 0;
  std::int64_t usual_width_ns_ = 0;
  std::int64_t slept_ns_ = 0;
  Duration ran_asleep_{};
  Duration wander_{};  // of CLOCK_REALTIME from what was commanded, at the last look
  // The reading that says best what the free-running face shows when CLOCK_MONOTONIC_RAW shows
  // something: not the last one, if that was wide.
  struct Anchor {
    FreeRunningTime free{};
    std::int64_t raw_ns = 0;
    std::int64_t width_ns = 0;
  } anchor_{};
  std::int64_t trusted_since_ns_;         // older stamps belong to before somebody's step
  std::optional<FreeRunningTime> end_{};  // of the running correction
  Duration lateness_{};
  Rate tracking_rate_{};
  // CLOCK_REALTIME against RAW differs from the commanded rate by the rounding of the kernel's
  // multipliers; measured over at least a second at a time.
  double gain_ = 1.0;
  Duration gain_deviation_{};
  std::int64_t gain_elapsed_ns_ = 0;
  RateStepMeter rate_steps_;  // of a hardware clock
  int expected_leap_ = 0;
  ForeignSteering foreign_{};
  std::uint64_t foreign_steps_ = 0;
  std::uint64_t foreign_rates_ = 0;
  std::optional<std::int64_t> unread_since_ns_{};  // by CLOCK_MONOTONIC_RAW
  std::optional<ClockError> failure_{};
};

}  // namespace ftcs::platform
