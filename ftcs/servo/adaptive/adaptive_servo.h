// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <type_traits>

#include "ftcs/estimation/estimator.h"
#include "ftcs/estimation/interval_meter.h"
#include "ftcs/estimation/load_aware_estimator.h"
#include "ftcs/estimation/stamp_ticks.h"
#include "ftcs/servo/adaptive/steering.h"
#include "ftcs/servo/learnt_state.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"
#include "ftcs/time/per_direction.h"

namespace ftcs {

/// Nothing here needs tuning: everything is a fact about the installation.
struct AdaptiveConfig {
  /// Interval between Sync messages in reference time. Zero: measured. It is the unit of time of
  /// the noise models and need only be right within a factor of two or three.
  Nanoseconds sync_interval{0};
  /// What the clock can do; F is 3 % unless told otherwise.
  SteeringLimits steering{};
  /// Path delay known otherwise (peer delay, wiring), and its standard deviation. Then one
  /// direction suffices from the second message on.
  std::optional<Nanoseconds> fixed_path_delay{};
  Nanoseconds path_delay_sigma{0};  ///< enters the stated deviations; not below zero
  /// What an earlier run has learnt: the rate and the noise to start from. Void after a reset.
  std::optional<LearntState> learnt{};
};

/// The first thing that is wrong: kSyncInterval, kRateLimits, kActuator (a limit of the steering or
/// the delay's deviation negative or not finite), kLearntState. No value: the servo can be made.
[[nodiscard]] std::optional<ServoConfigError> validate(const AdaptiveConfig& config) noexcept;

/// The adaptive clock servo: joint estimate of offset, rate and path delay from every timestamp
/// pair of either direction, with noise learnt on line, and the paper's deadbeat steering on the
/// filtered estimate. Derivation: docs/adaptive-servo.md.
///
/// Each pair is one observation, sigma = +1 forward and -1 backward:
///
///     z = free running - reference - base = x + sigma (d + n),    dx = y dt + noise of the clock
///
/// x offset and y rate of the *oscillator*, d path delay, n noise of the delay. A bank of Kalman
/// filters that differ in the clock's noise alone hears it (multiple-model adaptive estimation;
/// Magill, IEEE Trans. AC-10, 1965). The clock is then commanded, r = 1 + y:
///
///     correction rate = (1 - offset / T_c) / r  for T_c = interval / 8,  then 1 / r
///
/// which is eq. (17) with p = 1 on filtered values. Steering never enters the estimate, so that a
/// step or another servo's command on the clock between two messages is no event for it.
///
/// Three messages of both directions are enough to command, four of one direction, two with a known
/// path delay, if two of one direction are an eighth of an interval apart or a rate was learnt
/// before; until then update() hears and is silent. With one direction alone the unknown path delay
/// stays in the offset.
///
///     AdaptiveServo servo;                                       // no parameter needs tuning
///     const ServoUpdate update = servo.update(pair, clock.read());
///     if (update.has_command) clock.apply(update.command);
///
/// Some twenty kilobytes (SmallAdaptiveServo: below one); nothing is allocated, and the work for a
/// message is bounded: docs/adaptive-servo.md has the figures. Build it in place, not on the stack
/// of a real-time thread.
template <class Grid>
class BasicAdaptiveServo {
 public:
  using Config = AdaptiveConfig;

  /// Valid: validate(config) finds nothing; it is not asked here.
  explicit BasicAdaptiveServo(const AdaptiveConfig& config = {}) noexcept;

  /// One pair of either direction, in the order in which they become known; news (in_order.h).
  ///
  /// kUsed, or kRejected where the message is an outlier with more than half a chance; both may
  /// carry a command, since the estimate goes on. A rate that is half or more off nominal commands
  /// nothing.
  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  /// Another reference: everything measured is void, a learnt state included; the fixed path delay
  /// holds again, and the first command may step again.
  void reset() noexcept;
  /// A clock was set back: everything measured is void; the clock keeps its command, and a first
  /// step stays spent.
  void on_new_epoch() noexcept { forget(); }
  /// fixed_path_delay was a start, good to `sigma_ns`: until the next reset() the path delay is
  /// estimated, from messages of both directions.
  void free_path_delay(double sigma_ns) noexcept { estimator_.free_delay(sigma_ns); }
  /// As of the last message after which the servo steered.
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return describe(latest_, state_); }
  /// As of `now`: the offset that the clock has by the servo's belief, and how far that belief can
  /// be trusted. Without messages for a while the state is holdover and the deviation grows.
  [[nodiscard]] ServoSnapshot snapshot_at(const ClockReading& now) const noexcept;

 private:
  using Estimator = std::conditional_t<Grid::kFollowsFloor, estimation::LoadAwareEstimator<Grid>,
                                       estimation::Estimator<Grid>>;
  void forget() noexcept;
  void rebase(double z) noexcept;
  [[nodiscard]] estimation::Observation observe(const TimestampPair& pair) noexcept;
  [[nodiscard]] bool ready() const noexcept;
  struct Belief {
    double rate_deviation = 0.0;  ///< y: free running per reference, less one
    double offset_ns = 0.0;       ///< local - reference
    double cycles = 0.0;          ///< since the last message
  };
  [[nodiscard]] Belief believe(const ClockReading& now) const noexcept;
  [[nodiscard]] ServoUpdate steer(const ClockReading& now) noexcept;
  [[nodiscard]] ServoSnapshot describe(const Belief& belief, ServoState state) const noexcept;

  Nanoseconds sync_interval_;
  Estimator estimator_;
  adaptive::Steering steering_;
  estimation::IntervalMeter meter_;
  estimation::StampTicks ticks_{};
  Duration base_{};        ///< first z: keeps the states small
  ReferenceTime event_{};  ///< reference time to which the last message belongs
  Belief latest_{};
  ServoState state_ = ServoState::kUnlocked;
  bool started_ = false;
  bool rate_expected_ = false;  ///< from an earlier run
};

/// Twenty-eight noise models, and a second picture of paths on which messages queue.
using AdaptiveServo = BasicAdaptiveServo<estimation::FullGrid>;
/// Three noise models. Below 1 KiB, for microcontrollers: half a microsecond a message on a PC
/// core.
using SmallAdaptiveServo = BasicAdaptiveServo<estimation::SmallGrid>;

extern template class BasicAdaptiveServo<estimation::FullGrid>;
extern template class BasicAdaptiveServo<estimation::SmallGrid>;
static_assert(ClockServo<AdaptiveServo>);
static_assert(ClockServo<SmallAdaptiveServo>);

}  // namespace ftcs
