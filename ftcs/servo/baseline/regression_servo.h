// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

struct RegressionConfig {
  Nanoseconds sync_interval{0};  ///< zero: the time between the last two samples
  RateLimits limits{};
};

/// kSyncInterval or kRateLimits.
[[nodiscard]] std::optional<ServoConfigError> validate(const RegressionConfig& config) noexcept;

/// Baseline: growing-window linear regression, as linuxptp's linreg servo behaves (its documented
/// and measured behaviour; independent code).
///
/// Lines through the newest 4, 8, 16, 32 and 64 points (free-running time, reference time); each
/// window keeps the mean square of its one-step prediction errors; the largest window within 5 % of
/// the best one is used. Its slope is the rate; the offset is removed over one interval (windows up
/// to 16), two (32) or three (64).
class RegressionServo {
 public:
  using Config = RegressionConfig;

  explicit RegressionServo(const RegressionConfig& config = {}) noexcept : config_(config) {}

  /// Commands from the fourth sample on. A ratio outside 0.5 to 1.5, or time that went backward, is
  /// kImplausible and ends the line: the next one needs four samples again.
  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept;
  void reset() noexcept { *this = RegressionServo(config_); }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  static constexpr std::size_t kSizes[] = {4, 8, 16, 32, 64};
  static constexpr std::size_t kWindows = 5;
  static constexpr std::size_t kPoints = 64;

  struct Point {
    double x = 0.0;  ///< free running since the first point, ns
    double y = 0.0;  ///< reference minus free running, since the first point, ns
  };
  /// y = at_newest + slope (x - newest x)
  struct Window {
    bool fitted = false;
    double slope = 0.0;
    double at_newest = 0.0;
    double error = 0.0;  ///< mean square of prediction errors
    unsigned errors = 0;
  };

  void add(const SyncSample& sample) noexcept;
  void judge_predictions() noexcept;
  void fit(std::size_t window) noexcept;
  [[nodiscard]] std::size_t choose() const noexcept;
  [[nodiscard]] const Point& newest(std::size_t age) const noexcept {
    return points_[(count_ - 1 - age) % kPoints];
  }

  RegressionConfig config_;
  std::array<Point, kPoints> points_{};
  std::array<Window, kWindows> windows_{};
  std::size_t count_ = 0;
  SyncSample first_{};
  SyncSample previous_{};
  Duration interval_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<RegressionServo>);

}  // namespace ftcs
