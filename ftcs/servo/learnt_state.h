// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <optional>

#include "ftcs/servo/servo.h"

namespace ftcs {

/// What a servo has learnt that outlives it: facts about the oscillator and the network, from which
/// the next run may start. A plain value; keeping it between runs is the application's business.
/// rate_sigma is how far the rate is trusted: who keeps a state for days widens it by what the
/// oscillator does in that time (temperature, ageing).
struct LearntState {
  double rate_deviation = 0.0;      ///< y: free running per reference, less one
  double rate_sigma = 0.0;          ///< its standard deviation; > 0
  double timestamp_noise_ns = 0.0;  ///< of one timestamp; > 0

  /// What a servo can start from: finite, |y| < 1/2, deviations positive.
  [[nodiscard]] bool valid() const noexcept {
    return std::abs(rate_deviation) < 0.5 && rate_sigma > 0.0 && rate_sigma < 1.0 &&
           timestamp_noise_ns > 0.0 && timestamp_noise_ns < 1e9;
  }
};

/// Nothing if the servo does not know its rate and how well it knows it (only the adaptive servo
/// and the Kalman filter do).
[[nodiscard]] inline std::optional<LearntState> learnt_from(
    const ServoSnapshot& snapshot) noexcept {
  if (snapshot.state == ServoState::kUnlocked) return std::nullopt;
  const LearntState learnt{1.0 / snapshot.rate_ratio.ratio() - 1.0, snapshot.rate_sigma_ppb * 1e-9,
                           snapshot.timestamp_noise_ns};
  if (!learnt.valid()) return std::nullopt;
  return learnt;
}

}  // namespace ftcs
