// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/servo/adaptive/steering.h"
#include "ftcs/servo/baseline/kalman_filter.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"
#include "ftcs/time/per_direction.h"

namespace ftcs {

/// The noise has to be known; with a wrong one the filter is slow, or noisy, and says neither.
struct KalmanConfig {
  Nanoseconds sync_interval{0};  ///< zero: one second
  baseline::KalmanNoise noise{};
  std::optional<Nanoseconds> fixed_path_delay{};  ///< known otherwise: the two-state filter
  /// T_c as a part of the sync interval; above 0, at most 1.
  double correction_share = 0.125;
  RateLimits limits{};
};

/// The first thing that is wrong: kSyncInterval, kRateLimits, kCorrectionTime (the share), kNoise.
[[nodiscard]] std::optional<ServoConfigError> validate(const KalmanConfig& config) noexcept;

/// Baseline: a Kalman filter of fixed noise (Giorgi and Narduzzi [24]) with deadbeat steering.
/// Three states (offset, rate, path delay) from both directions, or two with a known path delay.
/// Given the true noise of a linear world it is the bound that no servo can beat there. It knows no
/// outliers, no queues and no jumps: each message is heard at its word.
class KalmanServo {
 public:
  using Config = KalmanConfig;

  explicit KalmanServo(const KalmanConfig& config = {}) noexcept;

  /// Commands at every message of either direction, from the third on, once both have come (with a
  /// known delay from the second on; backward messages are then not heard). Messages come in
  /// order (in_order.h).
  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  void reset() noexcept { *this = KalmanServo(config_); }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  void observe(const TimestampPair& pair) noexcept;
  [[nodiscard]] ServoUpdate steer(const ClockReading& now) noexcept;

  KalmanConfig config_;
  baseline::KalmanFilter filter_;
  adaptive::Steering steering_;
  double known_delay_ns_ = 0.0;
  unsigned messages_ = 0;
  Duration base_{};        ///< first free running minus reference: keeps the states small
  ReferenceTime event_{};  ///< reference time of the last event at the local clock
  PerDirection<bool> heard_{};
  ServoSnapshot snapshot_{};
};

static_assert(ClockServo<KalmanServo>);

}  // namespace ftcs
