// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/discipline/jump_plan.h"
#include "ftcs/discipline/lock_detector.h"
#include "ftcs/discipline/rate_change_limit.h"
#include "ftcs/discipline/step_policy.h"
#include "ftcs/discipline/telemetry.h"
#include "ftcs/measurement/sample_interval.h"
#include "ftcs/servo/in_order.h"
#include "ftcs/servo/servo.h"

namespace ftcs {

/// What holds whatever the servo. Nothing is checked here: valid are bands with 0 <= enter <=
/// leave, bounds that are not negative, and at least one missed interval.
struct DisciplineRules {
  StepPolicy step{};
  LockConfig lock{};
  /// A larger offset is not steered but refused, message by message, and the clock keeps its rate:
  /// a slew over seconds is a mistake of the set-up, or somebody's lie. Zero: no bound. Not asked
  /// where the policy permits a step.
  Nanoseconds largest_offset{0};
  /// The rate of the clock changes by no more at a time, dimensionless. Zero: any. The adaptive
  /// servo plans with it, any other is cut.
  double largest_rate_change = 0.0;
  /// Sync intervals without a usable sample before holdover: more than one or two lost messages. A
  /// sample that the servo refused is usable for that while the clock is within what a lock means,
  /// by the servo's deviation and by the sample's own word.
  std::uint32_t missed_intervals_to_holdover = kOutageIntervals;
};

/// What the discipline has to know of its servo. ClockDiscipline fills it in for the servos of the
/// library; who brings his own says so here.
struct ServoTraits {
  RateLimits limits{};           ///< narrowed by the clock's own
  RateLimits slewing{};          ///< what it uses of them to remove an offset
  Nanoseconds sync_interval{0};  ///< zero: as the messages come
  bool path_delay_is_fixed = false;
  bool decides_steps = false;  ///< has thresholds of its own, and its start-up depends on them
  bool steers = true;          ///< else it only reports, and a lock is an offset that stays small
};

/// The one place where a servo meets a clock.
///
/// Completes each message with what the steered clock showed, asks the servo, applies step policy
/// and limits, and hands the command to the clock. The clock itself ends a correction after T_c
/// (AdjustableClock), so that a lost message does no harm. Counts and reports; decides nothing
/// about frequency or offset. What is asked of every message, whatever the servo, is asked here: is
/// it news (in_order.h), how long is the interval, is this an outage.
///
/// A command passes, in this order:
///
///     offset     beyond largest_offset, and no step permitted: not acted on, the rate is kept
///     step       |offset| > threshold and permitted: step = -offset, at the tracking rate, unless
///                the servo decides steps; permitted otherwise: as the servo asks; else none
///     length     the clock ends corrections late: the same one, over a longer time (late_expiry.h)
///     rate       |change| <= largest_rate_change, at the command and at the end of its correction
///     limits     slowest <= rate <= fastest, of servo and clock together
///     clock      apply(), which refuses what is not a number or infinite (kNotFinite); on its
///                error the last command stays in force
///
/// Of one servo, chosen by the program: nothing of any other is linked. ClockDiscipline has the
/// one that its configuration names.
///
///     ClockDiscipline discipline({}, clock);              // examples/01_lock_a_clock.cpp
///     discipline.on_pair({Direction::kForward, t1, t2});  // Sync
///     const Telemetry seen = discipline.on_pair({Direction::kBackward, t4, t3});  // Delay_Req
///
/// One thread. A call costs one reading of the clock, the servo's update, and at most one command.
template <ClockServo Servo>
class BasicClockDiscipline {
 public:
  /// The clock must outlive the discipline. `make` gets the limits that servo and clock leave,
  /// and returns the servo, which is made in place: some are too large for the stack.
  template <class MakeServo>
  BasicClockDiscipline(const DisciplineRules& rules, const ServoTraits& servo,
                       AdjustableClock& clock, const MakeServo& make) noexcept
      : config_(rules),
        traits_(servo),
        clock_(clock),
        limits_(intersect(servo.limits, clock.rate_limits())),
        servo_(make(limits_)),
        lock_(rules.lock),
        rate_change_(rules.largest_rate_change) {}

  /// Before the first message: from now on at this rate (local per free running), which somebody
  /// knows already; cut to the limits. The clock's error, if it did not take it. It does not count
  /// as the first command: a first step is still to come.
  [[nodiscard]] std::optional<ClockError> start_at(Rate rate) noexcept;
  /// A message of either direction, at any time after its stamps, in the order in which they became
  /// known. `paces`: such pairs come once a Sync interval; the forward ones are the samples, make
  /// the lock, and are missed when they stay away. Others are heard and no more.
  ///
  /// What came of it is in the telemetry: verdict, whether a command was given, why not
  /// (offset_refused, error), lock and state. The same is kept as latest().
  Telemetry on_pair(const EventPair& pair, bool paces = true) noexcept;
  /// To be called when nothing has come for a while, as often as liked: samples missing for
  /// missed_intervals_to_holdover sync intervals mean holdover. The clock keeps its tracking
  /// rate. A servo that knows its deviation states it as of now, grown since the last message.
  /// Nothing is said before the first sample: without an interval there is no silence.
  Telemetry on_silence() noexcept;
  /// What the time transmitter says of its Sync interval; zero: nothing. Messages that come in a
  /// burst are then not taken for a shorter one.
  void on_announced_interval(Duration interval) noexcept { announced_interval_ = interval; }
  /// From now on the path delay is estimated from messages of both directions, beginning at what
  /// the configuration says, give or take `sigma_ns`; until the next reference. Nothing happens
  /// where the servo cannot.
  void free_path_delay(double sigma_ns) noexcept;
  /// Another time transmitter: what was learnt about the old one is void; the clock keeps its
  /// rate.
  void on_new_reference() noexcept;
  /// Local time itself was put elsewhere (another UTC offset): a new reference, and a beginning:
  /// step policy is asked again as with the first offset.
  void on_new_timescale() noexcept;
  /// The same reference has jumped; positive: ahead. A new reference, and beyond
  /// largest_offset a beginning, as on_new_timescale(). Tells what will happen.
  JumpPlan on_reference_jump(Duration jump) noexcept;

  /// Used since this reference is followed.
  [[nodiscard]] std::uint32_t samples() const noexcept { return samples_; }
  /// What the last call told.
  [[nodiscard]] const Telemetry& latest() const noexcept { return telemetry_; }
  [[nodiscard]] const DisciplineCounters& counters() const noexcept { return counters_; }
  /// Never without a path delay: what it hides from the offset may be any length.
  [[nodiscard]] bool locked() const noexcept {
    return lock_.locked() && !in_holdover_ && path_delay_known();
  }
  /// It is configured, or this reference has answered and the servo made a delay of it.
  [[nodiscard]] bool path_delay_known() const noexcept {
    return traits_.path_delay_is_fixed || path_delay_measured_;
  }

 private:
  void begin(const ClockReading& reading) noexcept;
  void count(Direction direction, SampleVerdict verdict) noexcept;
  [[nodiscard]] bool lock_survives(const TimestampPair& refused) const noexcept;
  void note_sample(const EventPair& pair) noexcept;
  void check_silence(const ClockReading& reading) noexcept;
  void steer(const ServoCommand& wanted, Duration offset) noexcept;
  [[nodiscard]] ServoCommand with_step(ServoCommand command, Duration offset) const noexcept;
  [[nodiscard]] ServoCommand within_limits(ServoCommand command) noexcept;
  [[nodiscard]] bool at_limit(const ServoCommand& command) const noexcept;
  [[nodiscard]] bool refuses(Duration offset) const noexcept;
  [[nodiscard]] bool servo_knows_path_delay() const noexcept;
  const Telemetry& finish() noexcept;
  [[nodiscard]] ServoSnapshot known(ServoSnapshot snapshot) const noexcept;
  [[nodiscard]] Duration slew_time(Duration jump) const noexcept;

  DisciplineRules config_;
  ServoTraits traits_;
  AdjustableClock& clock_;
  RateLimits limits_;
  MessageOrder order_{};
  Servo servo_;
  LockDetector lock_;
  RateChangeLimit rate_change_;
  bool answered_ = false;  ///< a backward message of this reference was used
  bool path_delay_measured_ = false;
  bool first_command_ = true;
  bool in_holdover_ = false;
  bool has_sample_ = false;
  std::uint32_t samples_ = 0;
  bool awaits_sample_ = false;  ///< of another reference, since waiting_since_
  FreeRunningTime waiting_since_{};
  EventPair last_sample_{};
  SampleInterval sync_interval_{};  ///< asked where none is configured
  Duration announced_interval_{};
  Telemetry telemetry_{};
  DisciplineCounters counters_{};
};

}  // namespace ftcs

#include "ftcs/discipline/basic_clock_discipline_impl.h"
