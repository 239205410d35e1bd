// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

/// How exchanges are chosen in a network where messages wait: the shorter the delay, the truer.
enum class DelaySelection : std::uint8_t {
  kWeights,  ///< all of them, weighted by how much their delay exceeds the least one
  kWindow,   ///< the earliest message of each direction in every window of `window` exchanges
};

struct MinimumDelayConfig {
  Nanoseconds sync_interval{0};  ///< zero: the time between the last two exchanges
  RateLimits limits{};
  /// Known otherwise: every forward message is a point, there is nothing to choose by.
  std::optional<Nanoseconds> fixed_path_delay{};
  DelaySelection selection = DelaySelection::kWeights;
  std::uint32_t window = 32;  ///< of kWindow, 1 to 4096 exchanges
};

/// The first thing that is wrong: kSyncInterval, kRateLimits, kWindow.
[[nodiscard]] std::optional<ServoConfigError> validate(const MinimumDelayConfig& config) noexcept;

/// Baseline: selection by the delay of exchanges, as clients of NTP do it (Mills, RFC 5905, section
/// 10; chrony's documented behaviour: regression over up to 64 measurements, weighted by delay,
/// shortened while the signs of the residuals run; independent code).
///
/// An exchange is a forward message and the next backward one, both brought to their middle with
/// the rate in force: offset (f + b)/2, delay (f - b)/2. kWeights: weights 1/(1 + (delay -
/// least)/s)^2 with s a tenth of the mean excess, at least 20 ns. kWindow: one point a window, a
/// line through the last 8.
class MinimumDelayServo {
 public:
  using Config = MinimumDelayConfig;

  explicit MinimumDelayServo(const MinimumDelayConfig& config = {}) noexcept : config_(config) {}

  /// Commands with the backward message that completes an exchange (kWindow: a window; with a known
  /// delay each forward message), from the third point on; the offset is removed over one interval.
  /// At most 64 points are fitted, some twenty times where the line is bent.
  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept;
  void reset() noexcept { *this = MinimumDelayServo(config_); }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  static constexpr std::size_t kPoints = 64;
  static constexpr std::size_t kWindowPoints = 8;

  /// Free running minus reference at a reference time, both against the first message, ns.
  struct Stamp {
    double x = 0.0;
    double y = 0.0;
  };
  struct Point {
    double x = 0.0;
    double offset = 0.0;
    double delay = 0.0;
  };

  [[nodiscard]] Stamp stamp_of(const TimestampPair& pair) const noexcept;
  [[nodiscard]] bool add(const TimestampPair& pair) noexcept;
  void add_point(const Point& point) noexcept;
  void add_exchange(const Stamp& forward, const Stamp& backward) noexcept;
  void add_to_window(const Stamp& forward, const Stamp& backward) noexcept;
  void fit() noexcept;
  [[nodiscard]] bool fit_line(std::size_t count) noexcept;
  [[nodiscard]] bool residuals_run(std::size_t count) const noexcept;
  [[nodiscard]] double weight_of(const Point& point, double least, double scale) const noexcept;
  [[nodiscard]] const Point& newest(std::size_t age) const noexcept {
    return points_[(count_ - 1 - age) % kPoints];
  }
  [[nodiscard]] ServoUpdate steer(const ClockReading& now) noexcept;

  MinimumDelayConfig config_;
  std::array<Point, kPoints> points_{};
  std::size_t count_ = 0;   ///< points ever
  std::size_t length_ = 0;  ///< points in use
  TimestampPair first_{};
  bool started_ = false;
  std::optional<Stamp> forward_{};
  std::array<Stamp, 2> earliest_{};  ///< of the window, by direction
  std::uint32_t in_window_ = 0;
  double interval_ns_ = 0.0;
  double last_x_ = 0.0;
  double slope_ = 0.0;      ///< free running per reference, minus 1
  double at_newest_ = 0.0;  ///< of the line, at the newest point
  bool fitted_ = false;
  ServoSnapshot snapshot_{};
};

static_assert(ClockServo<MinimumDelayServo>);

}  // namespace ftcs
