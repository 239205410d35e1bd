// SPDX-License-Identifier: MIT
#include "ftcs/analysis/quantile_sketch.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

// IEEE 754 binary64: 52 bits of mantissa below an exponent with bias 1023.
constexpr int kDoubleMantissaBits = 52;
constexpr std::int64_t kDoubleExponentBias = 1023;

}  // namespace

QuantileSketch::QuantileSketch() : negative_(kBinsPerSign), positive_(kBinsPerSign) {}

std::size_t QuantileSketch::bin_of(double magnitude) noexcept {
  // Exponent and leading mantissa bits, read as one integer, count the bins; no logarithm is
  // needed.
  const auto bits = std::bit_cast<std::int64_t>(magnitude) >> (kDoubleMantissaBits - kMantissaBits);
  constexpr std::int64_t kFirst = (kDoubleExponentBias + kSmallestExponent) << kMantissaBits;
  return std::min(static_cast<std::size_t>(bits - kFirst), kBinsPerSign - 1);
}

double QuantileSketch::middle_of(std::size_t bin) noexcept {
  const int exponent = kSmallestExponent + static_cast<int>(bin / kBinsPerOctave);
  const double within = (static_cast<double>(bin % kBinsPerOctave) + 0.5) / double{kBinsPerOctave};
  return std::ldexp(1.0 + within, exponent);
}

void QuantileSketch::add(double value) noexcept {
  if (!std::isfinite(value)) return;
  constexpr double kSmallest = 0x1p-30;
  static_assert(kSmallestExponent == -30);
  ++count_;
  const double magnitude = std::abs(value);
  if (magnitude < kSmallest) {
    ++zero_;
  } else {
    ++(value < 0.0 ? negative_ : positive_)[bin_of(magnitude)];
  }
}

void QuantileSketch::merge(const QuantileSketch& other) noexcept {
  for (std::size_t bin = 0; bin < kBinsPerSign; ++bin) {
    negative_[bin] += other.negative_[bin];
    positive_[bin] += other.positive_[bin];
  }
  zero_ += other.zero_;
  count_ += other.count_;
}

std::uint64_t QuantileSketch::rank_of(double fraction) const noexcept {
  const double last = static_cast<double>(count_ - 1);
  return static_cast<std::uint64_t>(std::llround(std::clamp(fraction, 0.0, 1.0) * last));
}

double QuantileSketch::quantile(double fraction) const noexcept {
  if (count_ == 0) return kNoFigure;
  const std::uint64_t rank = rank_of(fraction);
  std::uint64_t seen = 0;
  for (std::size_t bin = kBinsPerSign; bin-- > 0;) {  // from the most negative value upwards
    seen += negative_[bin];
    if (seen > rank) return -middle_of(bin);
  }
  seen += zero_;
  if (seen > rank) return 0.0;
  for (std::size_t bin = 0; bin < kBinsPerSign; ++bin) {
    seen += positive_[bin];
    if (seen > rank) return middle_of(bin);
  }
  return middle_of(kBinsPerSign - 1);
}

double QuantileSketch::absolute_quantile(double fraction) const noexcept {
  if (count_ == 0) return kNoFigure;
  const std::uint64_t rank = rank_of(fraction);
  std::uint64_t seen = zero_;
  if (seen > rank) return 0.0;
  for (std::size_t bin = 0; bin < kBinsPerSign; ++bin) {
    seen += negative_[bin] + positive_[bin];
    if (seen > rank) return middle_of(bin);
  }
  return middle_of(kBinsPerSign - 1);
}

}  // namespace ftcs
