// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

namespace ftcs {

/// Why a servo's configuration cannot work.
enum class ServoConfigError : std::uint8_t {
  kSyncInterval,
  kCorrectionTime,
  kOffsetGain,
  kConvergedBand,
  kRateLimits,
  kPlausibleRatio,
  kProportionalGain,
  kIntegralGain,
  kStepThreshold,
  kNoise,
  kActuator,
  kLearntState,
  kWindow,
  kExternal,
  kPathDelay,
  kOutlierGate,
};

/// One sentence: what was expected.
[[nodiscard]] constexpr std::string_view describe(ServoConfigError error) noexcept {
  switch (error) {
    case ServoConfigError::kSyncInterval:
      return "the sync interval must not be negative";
    case ServoConfigError::kCorrectionTime:
      return "the correction time must lie between 0 and the sync interval";
    case ServoConfigError::kOffsetGain:
      return "the offset gain must lie between 0 and 1";
    case ServoConfigError::kConvergedBand:
      return "the converged band needs 0 <= enter <= leave";
    case ServoConfigError::kRateLimits:
      return "the rate limits need 0 < slowest <= 1 <= fastest";
    case ServoConfigError::kPlausibleRatio:
      return "the plausible rate ratios need 0 < slowest <= 1 <= fastest";
    case ServoConfigError::kProportionalGain:
      return "the proportional gain must be finite and not negative";
    case ServoConfigError::kIntegralGain:
      return "the integral gain must be finite and not negative";
    case ServoConfigError::kNoise:
      return "the noise of a Kalman filter must be finite, that of timestamps above zero";
    case ServoConfigError::kStepThreshold:
      return "a step threshold must not be negative";
    case ServoConfigError::kActuator:
      return "latency, granularity and largest rate change must be finite and not negative";
    case ServoConfigError::kLearntState:
      return "a learnt state needs a rate within 50 % of nominal, deviation and noise above zero";
    case ServoConfigError::kExternal:
      return "a servo of a shared library needs its functions and an instance";
    case ServoConfigError::kPathDelay:
      return "the path delay needs lowest <= highest and a filter over 1 to 32 delays";
    case ServoConfigError::kOutlierGate:
      return "the outlier gate needs a width above zero, a warm-up of at most 32 messages, one "
             "rejection or more to exit and a resolution above zero";
    case ServoConfigError::kWindow:
      return "a window must hold 1 to 4096 exchanges";
  }
  return "unknown configuration error";
}

}  // namespace ftcs
