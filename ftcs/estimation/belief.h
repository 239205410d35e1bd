// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/estimation/lanes.h"

namespace ftcs::estimation {

/// The one scale on which the parts of the estimator judge: how much evidence
/// convinces, how far is far, for how long something is remembered. They take
/// their thresholds from here; what a part has of its own stands beside it.

/// Evidence in nats, logarithms of likelihood ratios. A wrong hypothesis that
/// starts from nothing reaches n nats once in e^n trials at most (Wald, Annals
/// of Mathematical Statistics 16, 1945).
inline constexpr double kHint = 5.0;          ///< e^5 = 150
inline constexpr double kConvincing = 10.0;   ///< 22,000
inline constexpr double kSure = 14.0;         ///< 1.2 million
inline constexpr double kCertain = 20.0;      ///< 5e8
inline constexpr double kBeyondDoubt = 40.0;  ///< whatever the model of it is worth

/// Normalised innovations squared, nu^2 / S.
inline constexpr double kTwoSigma = 4.0;
inline constexpr double kThreeSigma = 9.0;
inline constexpr double kFarOff = 20.0;  ///< four and a half sigma: once in 300,000 messages
inline constexpr double kEightSigma = 64.0;
inline constexpr double kFiveSigma2 = 25.0;  ///< of one estimate against another

/// Memories, in messages.
inline constexpr double kLongestMemory = 4000.0;  ///< of what should never change
inline constexpr double kLongMemory = 1000.0;     ///< of the size of the noise
inline constexpr double kLoadMemory = 400.0;      ///< of what the load makes of it
inline constexpr std::uint16_t kOutlierMemory = 48;
inline constexpr std::uint8_t kShortMemory = 24;  ///< so many tell a mean
inline constexpr std::uint8_t kLately = 8;
inline constexpr std::uint8_t kRepeated = 6;  ///< alike, in a row: no chance
inline constexpr std::uint8_t kFew = 4;       ///< fewer prove nothing

/// Probabilities.
inline constexpr double kHardlyEver = 1e-5;
inline constexpr double kSeldom = 0.002;
inline constexpr double kNowAndThen = 0.02;
inline constexpr double kUnlikely = 0.1;
inline constexpr double kOften = 0.2;
inline constexpr double kNearlyAll = 0.9;

/// Times by which one is plainly larger than another.
inline constexpr double kMuch = 4.0;
/// Times by which one is so much larger that the other is none beside it.
inline constexpr double kFarLarger = 32.0;
/// Below this part of it something is small beside another.
inline constexpr double kSmallPart = 0.25;

/// The least noise of a timestamp, ns: a fit may be exact, stamps are not.
inline constexpr double kLeastNoise = 1e-4;
/// Variance of what nothing is known of, in units of the noise's.
inline constexpr double kUnknown = 1e10;
/// A floor is one if it is known to this part of the mean wait.
inline constexpr double kSharp = 1.0 / 16.0;
/// Cycles. Across a longer silence nothing before it tells a line, and times
/// would cost digits.
inline constexpr double kLongestGap = 4096.0;

/// ln of the range over which something of any size lies: log-uniform over e^10.
inline constexpr double kLogRange = 10.0;
/// One over the density of an error of any size, ns; even up to three sigma.
template <class V>
[[nodiscard]] inline V any_size(const V& error, const V& sigma) noexcept {
  return kLogRange * larger<V>(magnitude(error), 3.0 * sigma);
}

}  // namespace ftcs::estimation
