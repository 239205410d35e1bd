// SPDX-License-Identifier: MIT
#include "ftcs/analysis/stability.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>

#include "ftcs/analysis/statistics.h"
#include "ftcs/analysis/total_stretches.h"

namespace ftcs {
namespace {

struct NamedDeviation {
  Deviation deviation;
  const char* name;
};
constexpr NamedDeviation kNames[] = {
    {Deviation::kAllan, "ADEV"},         {Deviation::kOverlappingAllan, "OADEV"},
    {Deviation::kModifiedAllan, "MDEV"}, {Deviation::kTime, "TDEV"},
    {Deviation::kHadamard, "HDEV"},      {Deviation::kOverlappingHadamard, "OHDEV"},
    {Deviation::kTotal, "TOTDEV"},       {Deviation::kModifiedTotal, "MTOTDEV"},
    {Deviation::kTimeTotal, "TTOTDEV"},  {Deviation::kHadamardTotal, "HTOTDEV"},
};

/// Of stretches of 3m values? Not HTOT at m = 1: half-averages of three frequencies leave nothing.
bool is_of_stretches(Deviation deviation, std::size_t m) {
  return deviation == Deviation::kModifiedTotal || deviation == Deviation::kTimeTotal ||
         (deviation == Deviation::kHadamardTotal && m > 1);
}

/// A window of MDEV with fewer of its second differences present is not used.
constexpr double kSmallestShareOfWindow = 0.75;

std::span<const double> without_outer_gaps(std::span<const double> phase) {
  while (!phase.empty() && !std::isfinite(phase.front())) phase = phase.subspan(1);
  while (!phase.empty() && !std::isfinite(phase.back())) phase = phase.first(phase.size() - 1);
  return phase;
}

MeanSquare second_differences(std::span<const double> x, std::size_t m, std::size_t stride) {
  MeanSquare square;
  for (std::size_t i = 0; i + 2 * m < x.size(); i += stride) {
    square.add((x[i + 2 * m] - x[i + m]) - (x[i + m] - x[i]));
  }
  return square;
}

MeanSquare third_differences(std::span<const double> x, std::size_t m, std::size_t stride) {
  MeanSquare square;
  for (std::size_t i = 0; i + 3 * m < x.size(); i += stride) {
    square.add((x[i + 3 * m] - x[i]) - 3.0 * (x[i + 2 * m] - x[i + m]));
  }
  return square;
}

/// Means of m successive second differences, by a sliding sum.
MeanSquare averaged_second_differences(std::span<const double> x, std::size_t m) {
  const auto second_difference = [x, m](std::size_t i) {
    return (x[i + 2 * m] - x[i + m]) - (x[i + m] - x[i]);
  };
  MeanSquare square;
  double sum = 0.0;
  std::size_t present = 0;
  const double fewest = kSmallestShareOfWindow * static_cast<double>(m);
  for (std::size_t i = 0; i + 2 * m < x.size(); ++i) {
    const double entering = second_difference(i);
    if (entering == entering) {
      sum += entering;
      ++present;
    }
    if (i + 1 < m) continue;
    if (static_cast<double>(present) >= fewest) square.add(sum / static_cast<double>(present));
    const double leaving = second_difference(i + 1 - m);
    if (leaving == leaving) {
      sum -= leaving;
      --present;
    }
  }
  return square;
}

/// Second differences about each inner point of the record, continued by reflection about its end
/// points.
MeanSquare reflected_second_differences(std::span<const double> x, std::size_t m) {
  MeanSquare square;
  const std::size_t last = x.size() - 1;
  for (std::size_t i = 1; i < last; ++i) {
    const double before = i >= m ? x[i - m] : 2.0 * x[0] - x[m - i];
    const double after = i + m <= last ? x[i + m] : 2.0 * x[last] - x[2 * last - i - m];
    square.add((after - x[i]) - (x[i] - before));
  }
  return square;
}

MeanSquare stretch_differences(Deviation deviation, std::span<const double> x, std::size_t m) {
  if (deviation != Deviation::kHadamardTotal) return total_of_stretches(x, m);
  // Frequencies times tau: their second difference of means is the third difference of phase.
  std::vector<double> steps;
  steps.reserve(x.size());
  for (std::size_t i = 1; i < x.size(); ++i)
    steps.push_back((x[i] - x[i - 1]) * static_cast<double>(m));
  return total_of_stretches(steps, m);
}

MeanSquare mean_square(Deviation deviation, std::span<const double> x, std::size_t m) {
  if (is_of_stretches(deviation, m)) return stretch_differences(deviation, x, m);
  switch (deviation) {
    case Deviation::kAllan:
      return second_differences(x, m, m);
    case Deviation::kOverlappingAllan:
      return second_differences(x, m, 1);
    case Deviation::kModifiedAllan:
    case Deviation::kTime:
      return averaged_second_differences(x, m);
    case Deviation::kHadamard:
      return third_differences(x, m, m);
    case Deviation::kOverlappingHadamard:
    case Deviation::kHadamardTotal:
      return third_differences(x, m, 1);
    case Deviation::kTotal:
      return reflected_second_differences(x, m);
    case Deviation::kModifiedTotal:
    case Deviation::kTimeTotal:
      break;  // of stretches
  }
  return {};
}

/// From the mean square of differences to the deviation.
double normalize(Deviation deviation, double square, double tau_s) {
  switch (deviation) {
    case Deviation::kHadamard:
    case Deviation::kOverlappingHadamard:
    case Deviation::kHadamardTotal:
      return std::sqrt(square / 6.0) / tau_s;
    case Deviation::kTime:
    case Deviation::kTimeTotal:
      return std::sqrt(square / 6.0);  // tau / sqrt(3) times sqrt(square / 2) / tau
    default:
      return std::sqrt(square / 2.0) / tau_s;
  }
}

/// Of the variance of a total deviation against the one that it stands for.
double bias(Deviation deviation, PowerLawNoise noise, std::size_t m) {
  constexpr double kModified[] = {0.69, 0.70, 0.73, 0.83, 0.94};  // alpha -2 to 2
  constexpr double kHadamard[] = {0.771, 0.851, 0.995, 1.0, 1.0};
  const int row = static_cast<int>(noise) + 2;
  if (!is_of_stretches(deviation, m)) return 1.0;
  return deviation == Deviation::kHadamardTotal ? kHadamard[row] : kModified[row];
}

VarianceShape shape_of(Deviation deviation) {
  VarianceShape shape;
  shape.modified = deviation == Deviation::kModifiedAllan || deviation == Deviation::kTime;
  shape.overlapping = deviation != Deviation::kAllan && deviation != Deviation::kHadamard;
  if (deviation == Deviation::kHadamard || deviation == Deviation::kOverlappingHadamard ||
      deviation == Deviation::kHadamardTotal) {
    shape.difference_order = 3;
  }
  return shape;
}

/// Points that one term spans, and the step from one term to the next.
std::size_t possible_terms(Deviation deviation, std::size_t m, std::size_t points) {
  const VarianceShape shape = shape_of(deviation);
  if (deviation == Deviation::kTotal) return points > m + 1 ? points - 2 : 0;
  if (is_of_stretches(deviation, m)) {
    const std::size_t values = deviation == Deviation::kHadamardTotal ? points - 1 : points;
    return values < 3 * m ? 0 : (values - 3 * m) / stretch_stride(values, m) + 1;
  }
  const std::size_t span =
      static_cast<std::size_t>(shape.difference_order) * m + (shape.modified ? m : 1);
  if (points < span) return 0;
  return 1 + (points - span) / (shape.overlapping ? 1 : m);
}

double degrees_of_freedom(Deviation deviation, PowerLawNoise noise, std::size_t m,
                          std::size_t points) {
  if (deviation == Deviation::kTotal) return total_degrees_of_freedom(noise, m, points);
  if (deviation == Deviation::kModifiedTotal || deviation == Deviation::kTimeTotal)
    return modified_total_degrees_of_freedom(noise, m, points);
  if (is_of_stretches(deviation, m)) return hadamard_total_degrees_of_freedom(noise, m, points);
  return equivalent_degrees_of_freedom(noise, shape_of(deviation), m, points);
}

/// Where the noise cannot be told any more it may have become redder, by a power of f an octave as
/// one law takes over from another: the fewest degrees of freedom of those that it may be.
double cautious_degrees_of_freedom(Deviation deviation, PowerLawNoise noise, std::size_t m,
                                   std::size_t points) {
  const double beyond =
      static_cast<double>(kFewestPointsForNoise * m) / static_cast<double>(points);
  const int octaves = beyond > 1.0 ? static_cast<int>(std::ceil(std::log2(beyond))) : 0;
  double fewest = degrees_of_freedom(deviation, noise, m, points);
  const int reddest = std::max(static_cast<int>(noise) - octaves, -2);
  for (int alpha = static_cast<int>(noise) - 1; alpha >= reddest; --alpha) {
    const double redder =
        degrees_of_freedom(deviation, static_cast<PowerLawNoise>(alpha), m, points);
    fewest = std::min(fewest, redder);
  }
  return fewest;
}

std::vector<std::size_t> factors_of(std::size_t points, std::span<const std::size_t> mantissas,
                                    std::size_t base) {
  std::vector<std::size_t> factors;
  for (std::size_t power = 1; 2 * power < points; power *= base) {
    for (const std::size_t mantissa : mantissas) {
      if (2 * mantissa * power < points) factors.push_back(mantissa * power);
    }
  }
  return factors;
}

}  // namespace

const char* name(Deviation deviation) noexcept {
  for (const auto& [known, text] : kNames) {
    if (known == deviation) return text;
  }
  return "unknown";
}

std::optional<Deviation> deviation_named(std::string_view name) noexcept {
  const auto same = [](char small, char large) {
    return small == static_cast<char>(std::tolower(static_cast<unsigned char>(large)));
  };
  for (const auto& [deviation, text] : kNames) {
    const std::string_view known = text;
    if (std::equal(name.begin(), name.end(), known.begin(), known.end(), same)) return deviation;
  }
  return std::nullopt;
}

std::span<const Deviation> all_deviations() noexcept {
  static constexpr auto kAll = [] {
    std::array<Deviation, std::size(kNames)> all{};
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = kNames[i].deviation;
    return all;
  }();
  return kAll;
}

std::vector<StabilityPoint> stability(Deviation deviation, PhaseRecord record,
                                      std::span<const std::size_t> averaging_factors,
                                      double confidence) {
  std::vector<StabilityPoint> points;
  const std::span<const double> x = without_outer_gaps(record.seconds);
  PowerLawNoise noise = PowerLawNoise::kWhitePhase;
  for (const std::size_t m : averaging_factors) {
    const std::size_t possible = m == 0 ? 0 : possible_terms(deviation, m, x.size());
    if (possible == 0) continue;
    if (points.empty() || x.size() / m >= kFewestPointsForNoise) noise = identify_noise(x, m);
    const MeanSquare square = mean_square(deviation, x, m);
    if (square.terms == 0) continue;
    StabilityPoint point;
    point.averaging_factor = m;
    point.tau_s = static_cast<double>(m) * record.interval_s;
    point.deviation = normalize(deviation, square.mean() / bias(deviation, noise, m), point.tau_s);
    point.terms = square.terms;
    point.noise = noise;
    const double whole = cautious_degrees_of_freedom(deviation, noise, m, x.size());
    point.degrees_of_freedom =
        whole * static_cast<double>(square.terms) / static_cast<double>(possible);
    const ConfidenceInterval interval =
        confidence_interval(point.deviation, point.degrees_of_freedom, confidence);
    point.lower = interval.lower;
    point.upper = interval.upper;
    points.push_back(point);
  }
  return points;
}

std::vector<std::size_t> octave_factors(std::size_t points) {
  constexpr std::size_t kMantissas[] = {1};
  return factors_of(points, kMantissas, 2);
}

std::vector<std::size_t> decade_factors(std::size_t points) {
  constexpr std::size_t kMantissas[] = {1, 2, 4};
  return factors_of(points, kMantissas, 10);
}

std::vector<std::size_t> all_factors(std::size_t points) {
  constexpr double kMost = 1000.0;
  std::vector<std::size_t> factors;
  const std::size_t last = points > 2 ? (points - 1) / 2 : 0;
  const double ratio = std::pow(static_cast<double>(last), 1.0 / kMost);
  double next = 1.0;
  for (std::size_t m = 1; m <= last; ++m) {
    if (static_cast<double>(last) > kMost && static_cast<double>(m) < next) continue;
    factors.push_back(m);
    next = static_cast<double>(m) * ratio;
  }
  return factors;
}

std::vector<double> phase_from_frequency(std::span<const double> frequency, double interval_s) {
  RunningStatistics moments;
  for (const double y : frequency) moments.add(y);
  const double filler = moments.count() > 0 ? moments.mean() : 0.0;
  std::vector<double> phase;
  phase.reserve(frequency.size() + 1);
  phase.push_back(0.0);
  double x = 0.0;
  bool previous_missing = false;
  for (const double y : frequency) {
    const bool missing = !std::isfinite(y);
    if (missing && previous_missing) phase.back() = kNoFigure;
    x += (missing ? filler : y) * interval_s;
    phase.push_back(x);
    previous_missing = missing;
  }
  return phase;
}

}  // namespace ftcs
