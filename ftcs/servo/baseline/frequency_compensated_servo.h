// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

struct FrequencyCompensatedConfig {
  Nanoseconds sync_interval{0};  ///< not used: the law measures its interval
  RateLimits limits{};
};

/// kSyncInterval or kRateLimits.
[[nodiscard]] inline std::optional<ServoConfigError> validate(
    const FrequencyCompensatedConfig& config) noexcept {
  if (config.sync_interval < Nanoseconds{0}) return ServoConfigError::kSyncInterval;
  if (!config.limits.valid()) return ServoConfigError::kRateLimits;
  return std::nullopt;
}

/// Baseline: the frequency compensated clock of Balasubramanian, Harris and Moldovansky [26]:
///
///   scale(n) = (M(n) + D(n)) / S(n),   compensation(n) = scale(n) compensation(n-1)
///
/// M, S: what reference and local clock counted since the last Sync; D: reference minus local. The
/// ancestor of FTCS p = 1; it multiplies the *last commanded* rate, so that anything between
/// command and effect is an error, and it adds offset and rate instead of multiplying them.
class FrequencyCompensatedServo {
 public:
  using Config = FrequencyCompensatedConfig;

  explicit FrequencyCompensatedServo(const FrequencyCompensatedConfig& config = {}) noexcept
      : config_(config) {}

  /// Commands from the second sample on. A sample that is not newer on both clocks is kDuplicate.
  ServoUpdate update(const SyncSample& sample, const ClockReading&) noexcept {
    snapshot_.offset = sample.offset();
    snapshot_.path_delay = sample.path_delay;
    const bool first = !has_previous_;
    const SyncSample previous = previous_;
    const double reference_ns = (sample.reference() - previous.reference()).ns();
    const double local_ns = (sample.local - previous.local).ns();
    if (!first && !(reference_ns > 0.0 && local_ns > 0.0))
      return {SampleVerdict::kDuplicate, false, {}};
    previous_ = sample;
    has_previous_ = true;
    if (first) return {};
    const double scale = (reference_ns - sample.offset().ns()) / local_ns;
    rate_ = config_.limits.clamp(rate_ * Rate::from_ratio(scale));
    snapshot_.state = ServoState::kLocked;
    snapshot_.rate_ratio = rate_;
    return {SampleVerdict::kUsed, true, {rate_, Duration{}, rate_, Duration{}}};
  }
  void reset() noexcept { has_previous_ = false; }
  /// The clock has been stepped by somebody else: its last reading moves along.
  void on_step(Duration step) noexcept { previous_.local = previous_.local + step; }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  FrequencyCompensatedConfig config_;
  Rate rate_{};
  bool has_previous_ = false;
  SyncSample previous_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<FrequencyCompensatedServo>);

}  // namespace ftcs
