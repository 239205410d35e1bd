// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <type_traits>

#include "ftcs/estimation/estimator.h"
#include "ftcs/estimation/interval_meter.h"
#include "ftcs/estimation/load_aware_estimator.h"
#include "ftcs/estimation/message_order.h"
#include "ftcs/servo/adaptive/steering.h"
#include "ftcs/servo/learnt_state.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"
#include "ftcs/time/per_direction.h"

namespace ftcs {

/// Nothing here needs tuning: everything is a fact about the installation.
struct AdaptiveConfig {
  /// Interval between Sync messages in reference time. Zero: measured.
  Nanoseconds sync_interval{0};
  SteeringLimits steering{};
  /// Path delay known otherwise (peer delay, wiring), and its standard deviation. Then one
  /// direction suffices from the second message on.
  std::optional<Nanoseconds> fixed_path_delay{};
  Nanoseconds path_delay_sigma{0};
  /// What an earlier run has learnt: the rate and the noise to start from. Void after a reset.
  std::optional<LearntState> learnt{};
};

[[nodiscard]] std::optional<ServoConfigError> validate(const AdaptiveConfig& config) noexcept;

/// The adaptive clock servo: joint estimate of offset, rate and path delay from every timestamp
/// pair of either direction, with noise learnt on line, and the paper's deadbeat steering on the
/// filtered estimate. Derivation: docs/adaptive-servo.md.
template <class Grid>
class BasicAdaptiveServo {
 public:
  using Config = AdaptiveConfig;

  explicit BasicAdaptiveServo(const AdaptiveConfig& config = {}) noexcept;

  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  void reset() noexcept;
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
  void rebase() noexcept;
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
  estimation::MessageOrder order_{};
  Duration base_{};             ///< first z: keeps the states small
  FreeRunningTime previous_{};  ///< of the last message
  ReferenceTime event_{};       ///< reference time to which the last message belongs
  Belief latest_{};
  ServoState state_ = ServoState::kUnlocked;
  bool started_ = false;
  bool rate_expected_ = false;  ///< from an earlier run
};

using AdaptiveServo = BasicAdaptiveServo<estimation::FullGrid>;
/// Below 1 KiB, for microcontrollers: half a microsecond a message on a PC core.
using SmallAdaptiveServo = BasicAdaptiveServo<estimation::SmallGrid>;

extern template class BasicAdaptiveServo<estimation::FullGrid>;
extern template class BasicAdaptiveServo<estimation::SmallGrid>;
static_assert(ClockServo<AdaptiveServo>);
static_assert(ClockServo<SmallAdaptiveServo>);

}  // namespace ftcs
