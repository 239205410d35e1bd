// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/servo/sample_progress.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

struct FreeRunningConfig {
  /// A measured ratio outside is reported as implausible.
  RateLimits plausible_ratio{};
};

[[nodiscard]] constexpr std::optional<ServoConfigError> validate(
    const FreeRunningConfig& config) noexcept {
  if (!config.plausible_ratio.valid()) return ServoConfigError::kPlausibleRatio;
  return std::nullopt;
}

/// Watches and never commands: offset, path delay and the ratio of the last two samples are
/// telemetry only. The ratio holds the noise of two stamps: at 1 s and 50 ns each, 70 ppb.
class FreeRunningServo {
 public:
  using Config = FreeRunningConfig;

  explicit FreeRunningServo(const FreeRunningConfig& config = {}) noexcept : config_(config) {}

  ServoUpdate update(const SyncSample& sample, const ClockReading&) noexcept {
    if (has_previous_) {
      const SampleProgress progress = progress_between(previous_, sample, config_.plausible_ratio);
      if (progress.verdict == SampleVerdict::kDuplicate) return {progress.verdict, false, {}};
      remember(sample);
      if (progress.verdict != SampleVerdict::kUsed) return {progress.verdict, false, {}};
      snapshot_.rate_ratio = progress.ratio();
      return {};
    }
    remember(sample);
    return {};
  }
  void reset() noexcept { has_previous_ = false; }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  void remember(const SyncSample& sample) noexcept {
    previous_ = instant_of(sample);
    has_previous_ = true;
    snapshot_.offset = sample.offset();
    snapshot_.path_delay = sample.path_delay;
  }

  FreeRunningConfig config_;
  bool has_previous_ = false;
  SampleInstant previous_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<FreeRunningServo>);

}  // namespace ftcs
