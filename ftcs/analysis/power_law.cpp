// SPDX-License-Identifier: MIT
#include "ftcs/analysis/power_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <boost/math/distributions/chi_squared.hpp>

#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

/// Above this averaging factor the sum over covariances is as good as its integral (error below 0.5
/// %).
constexpr std::size_t kLargestFullSum = 1024;
/// Binomial coefficients C(2d, d - k), the weights of the 2d-th difference, for d = 1, 2, 3.
constexpr std::array<std::array<double, 4>, 4> kDifferenceWeights = {
    {{1, 0, 0, 0}, {2, 1, 0, 0}, {6, 4, 1, 0}, {20, 15, 6, 1}}};

/// Autocorrelation at lag 1 about the mean, over the pairs of which both are present.
double lag_one_autocorrelation(std::span<const double> series) {
  RunningStatistics moments;
  for (const double value : series) moments.add(value);
  const double mean = moments.mean();
  double squares = 0.0;
  double products = 0.0;
  double previous = kNoFigure;
  for (const double value : series) {
    const double distance = value - mean;
    if (std::isfinite(distance)) squares += distance * distance;
    if (std::isfinite(distance * previous)) products += distance * previous;
    previous = distance;
  }
  return squares > 0.0 ? products / squares : 0.0;
}

void difference(std::vector<double>& series) {
  for (std::size_t i = 0; i + 1 < series.size(); ++i) series[i] = series[i + 1] - series[i];
  series.pop_back();
}

/// Greenhall & Riley's s_w: the generalised autocovariance of the phase, up to a factor.
double phase_covariance(double t, PowerLawNoise noise) {
  const double a = std::abs(t);
  if (a == 0.0) return 0.0;
  switch (noise) {
    case PowerLawNoise::kWhitePhase:
      return -a;
    case PowerLawNoise::kFlickerPhase:
      return a * a * std::log(a);
    case PowerLawNoise::kWhiteFrequency:
      return a * a * a;
    case PowerLawNoise::kFlickerFrequency:
      return -a * a * a * a * std::log(a);
    case PowerLawNoise::kRandomWalkFrequency:
      return -a * a * a * a * a;
  }
  return 0.0;
}

/// s_x: of the phase after the filter F (their eq. 8). Flicker PM at large F in its limit, where
/// the second difference would cancel: 2 ln F at zero, -(2 ln t + 3) elsewhere.
double filtered_covariance(double t, double filter, PowerLawNoise noise) {
  if (noise == PowerLawNoise::kFlickerPhase && filter > double{kLargestFullSum}) {
    return t == 0.0 ? 2.0 * std::log(filter) : -(2.0 * std::log(std::abs(t)) + 3.0);
  }
  const double step = 1.0 / filter;
  return filter * filter *
         (2.0 * phase_covariance(t, noise) - phase_covariance(t - step, noise) -
          phase_covariance(t + step, noise));
}

/// s_z: of the d-th difference of the filtered phase (their eq. 9).
double differenced_covariance(double t, double filter, PowerLawNoise noise, int order) {
  const auto& weights = kDifferenceWeights[static_cast<std::size_t>(order)];
  double sum = weights[0] * filtered_covariance(t, filter, noise);
  for (int k = 1; k <= order; ++k) {
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    sum += sign * weights[static_cast<std::size_t>(k)] *
           (filtered_covariance(t - k, filter, noise) + filtered_covariance(t + k, filter, noise));
  }
  return sum;
}

/// White PM, not filtered: only lags that are multiples of m are correlated, the sum has d terms.
double white_phase_degrees(int order, double terms, double stride_share) {
  const auto& weights = kDifferenceWeights[static_cast<std::size_t>(order)];
  double sum = 1.0;
  for (int k = 1; k <= order; ++k) {
    const double correlation = weights[static_cast<std::size_t>(k)] / weights[0];
    sum += 2.0 * std::max(0.0, 1.0 - k * stride_share / terms) * correlation * correlation;
  }
  return terms / sum;
}

}  // namespace

const char* name(PowerLawNoise noise) noexcept {
  switch (noise) {
    case PowerLawNoise::kWhitePhase:
      return "white PM";
    case PowerLawNoise::kFlickerPhase:
      return "flicker PM";
    case PowerLawNoise::kWhiteFrequency:
      return "white FM";
    case PowerLawNoise::kFlickerFrequency:
      return "flicker FM";
    case PowerLawNoise::kRandomWalkFrequency:
      return "random-walk FM";
  }
  return "unknown";
}

PowerLawNoise identify_noise(std::span<const double> phase, std::size_t averaging_factor) {
  const std::size_t stride = std::max<std::size_t>(averaging_factor, 1);
  std::vector<double> series;
  series.reserve(phase.size() / stride + 1);
  for (std::size_t i = 0; i < phase.size(); i += stride) series.push_back(phase[i]);
  if (series.size() < 3) return PowerLawNoise::kWhitePhase;

  constexpr double kStationary = 0.25;  // below it the series needs no further difference
  constexpr int kMostDifferences = 2;   // enough for random-walk FM
  int differences = 0;
  double delta = 0.0;
  while (true) {
    const double r = lag_one_autocorrelation(series);
    delta = r / (1.0 + r);
    if (delta < kStationary || differences == kMostDifferences) break;
    difference(series);
    ++differences;
  }
  const double alpha = std::round(2.0 - 2.0 * (differences + delta));
  return static_cast<PowerLawNoise>(static_cast<int>(std::clamp(alpha, -2.0, 2.0)));
}

double equivalent_degrees_of_freedom(PowerLawNoise noise, VarianceShape shape,
                                     std::size_t averaging_factor, std::size_t points) {
  const int order = std::clamp(shape.difference_order, 1, 3);
  const auto m = static_cast<double>(averaging_factor);
  const double length = (shape.modified ? m : 1.0) + m * order;  // L, points that one term spans
  if (averaging_factor == 0 || static_cast<double>(points) < length) return 0.0;
  const double stride = shape.overlapping ? m : 1.0;                                           // S
  const double terms = 1.0 + std::floor(stride * (static_cast<double>(points) - length) / m);  // M
  if (noise == PowerLawNoise::kWhitePhase && !shape.modified) {
    return white_phase_degrees(order, terms, stride);
  }
  // Beyond kLargestFullSum the sum of a smaller m is scaled: same shape, fewer and wider steps.
  const double steps = std::min(m, double{kLargestFullSum});
  const double scale = shape.overlapping ? m / steps : 1.0;
  const double scaled_stride = stride / scale;
  const double scaled_terms = terms / scale;
  const double filter = shape.modified ? 1.0 : steps;
  const double most = std::min(std::ceil(scaled_terms), (order + 1) * scaled_stride);  // J
  double sum = 0.0;
  for (double j = 1.0; j < most; ++j) {
    const double covariance = differenced_covariance(j / scaled_stride, filter, noise, order);
    sum += 2.0 * std::max(0.0, 1.0 - j / scaled_terms) * covariance * covariance;
  }
  const double last = differenced_covariance(most / scaled_stride, filter, noise, order);
  sum += std::max(0.0, 1.0 - most / scaled_terms) * last * last;
  const bool flicker_phase = noise == PowerLawNoise::kFlickerPhase && !shape.modified;
  const double variance = differenced_covariance(0.0, flicker_phase ? m : filter, noise, order);
  return terms * variance * variance / (variance * variance + scale * sum);
}

double total_degrees_of_freedom(PowerLawNoise noise, std::size_t averaging_factor,
                                std::size_t points) noexcept {
  if (averaging_factor == 0) return 0.0;
  const double ratio = static_cast<double>(points) / static_cast<double>(averaging_factor);
  switch (noise) {
    case PowerLawNoise::kFlickerFrequency:
      return 1.17 * ratio - 0.22;
    case PowerLawNoise::kRandomWalkFrequency:
      return 0.93 * ratio - 0.36;
    default:
      return 1.50 * ratio;
  }
}

double modified_total_degrees_of_freedom(PowerLawNoise noise, std::size_t averaging_factor,
                                         std::size_t points) noexcept {
  if (averaging_factor == 0) return 0.0;
  const double ratio = static_cast<double>(points) / static_cast<double>(averaging_factor);
  switch (noise) {
    case PowerLawNoise::kWhitePhase:
      return 1.90 * ratio - 2.10;
    case PowerLawNoise::kFlickerPhase:
      return 1.20 * ratio - 1.40;
    case PowerLawNoise::kWhiteFrequency:
      return 1.10 * ratio - 1.20;
    case PowerLawNoise::kFlickerFrequency:
      return 0.85 * ratio - 0.50;
    case PowerLawNoise::kRandomWalkFrequency:
      return 0.75 * ratio - 0.31;
  }
  return 0.0;
}

double hadamard_total_degrees_of_freedom(PowerLawNoise noise, std::size_t averaging_factor,
                                         std::size_t points) noexcept {
  if (averaging_factor == 0) return 0.0;
  const double ratio = static_cast<double>(points) / static_cast<double>(averaging_factor);
  switch (noise) {
    case PowerLawNoise::kFlickerFrequency:
      return ratio / (0.868 + 1.140 / ratio);
    case PowerLawNoise::kRandomWalkFrequency:
      return ratio / (0.938 + 1.696 / ratio);
    default:
      return ratio / (0.559 + 1.004 / ratio);
  }
}

ConfidenceInterval confidence_interval(double deviation, double degrees_of_freedom,
                                       double confidence) {
  if (!(degrees_of_freedom > 0.0) || !std::isfinite(deviation) || !(confidence > 0.0) ||
      !(confidence < 1.0)) {
    return {kNoFigure, kNoFigure};
  }
  const boost::math::chi_squared distribution(degrees_of_freedom);
  const double tail = 0.5 * (1.0 - confidence);
  const double high = boost::math::quantile(boost::math::complement(distribution, tail));
  const double low = boost::math::quantile(distribution, tail);
  return {deviation * std::sqrt(degrees_of_freedom / high),
          deviation * std::sqrt(degrees_of_freedom / low)};
}

}  // namespace ftcs
