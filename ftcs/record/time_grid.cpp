// SPDX-License-Identifier: MIT
#include "ftcs/record/time_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "ftcs/analysis/line_fit.h"
#include "ftcs/analysis/statistics.h"
#include "ftcs/record/fields.h"

namespace ftcs {
namespace {

/// Share of each deviation by which the grid moves: ten steps of memory.
constexpr double kGridGain = 0.1;
/// A record whose gaps take more than this many times its samples has a wrong interval or wrong
/// times.
constexpr double kMostPlacesPerSample = 100.0;

double median_step(std::span<const double> times_s) {
  std::vector<double> steps;
  steps.reserve(times_s.size());
  for (std::size_t i = 1; i < times_s.size(); ++i) steps.push_back(times_s[i] - times_s[i - 1]);
  return upper_median(std::move(steps));
}

/// Number of the place of each time on a grid of about `step`, from 0.
std::vector<double> places_of(std::span<const double> times_s, double step) {
  std::vector<double> places = {0.0};
  for (std::size_t i = 1; i < times_s.size(); ++i)
    places.push_back(places.back() + std::round((times_s[i] - times_s[i - 1]) / step));
  return places;
}

/// The decimal number with the fewest digits within `tolerance` of `value`.
double shortest_within(double value, double tolerance) {
  constexpr int kMostDigits = 17;
  for (int digits = 1; digits < kMostDigits; ++digits) {
    const auto rounded = parse_decimal(fmt::format("{:.{}e}", value, digits - 1));
    if (rounded && std::abs(*rounded - value) <= tolerance) return *rounded;
  }
  return value;
}

/// The step of times that may be rounded: 62.5 ms stamped in ms are steps of 62 and 63. The median
/// step counts the places, a straight line through them is the interval, and of what the scatter
/// about the line permits the shortest number is meant.
double typical_step(std::span<const double> times_s) {
  const double median = median_step(times_s);
  if (!(median > 0.0)) return median;
  LineFit line{.slope = median};
  constexpr int kRounds = 3;  // a long gap has its places only when the step is nearly right
  for (int round = 0; round < kRounds; ++round) {
    line = fit_line(times_s, places_of(times_s, line.slope));
    // Farther off the places themselves are in doubt: jitter as long as the interval.
    if (!(std::abs(line.slope - median) < 0.5 * median)) return median;
  }
  constexpr double kDeviations = 3.0;
  return shortest_within(line.slope, kDeviations * line.slope_deviation);
}

}  // namespace

Result<GriddedValues, GridError> place_on_grid(std::span<const double> values,
                                               std::span<const double> times_s,
                                               std::optional<double> interval_s) {
  GriddedValues grid;
  if (values.empty()) return grid;
  grid.interval_s = interval_s ? *interval_s : times_s.size() > 1 ? typical_step(times_s) : 1.0;
  if (!(grid.interval_s > 0.0)) {
    return GridError{"half of the times do not advance: is the time column right?"};
  }
  const double most = kMostPlacesPerSample * static_cast<double>(values.size());
  double place_s = times_s[0];
  grid.values.push_back(values[0]);
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double steps = std::round((times_s[i] - place_s) / grid.interval_s);
    if (!(static_cast<double>(grid.values.size()) + steps < most)) {
      return GridError{"the gap before time " + std::to_string(times_s[i]) + " s is " +
                       std::to_string(steps) + " intervals of " + std::to_string(grid.interval_s) +
                       " s: are the time column, its unit and the interval right?"};
    }
    const double taken = std::max(steps, 1.0);
    grid.values.insert(grid.values.end(), static_cast<std::size_t>(taken) - 1,
                       std::numeric_limits<double>::quiet_NaN());
    grid.values.push_back(values[i]);
    if (steps < 1.0) {
      // An extra value: the grid starts anew from it, or all that follow would seem early.
      ++grid.crowded;
      place_s = times_s[i];
      continue;
    }
    place_s += taken * grid.interval_s;
    place_s += kGridGain * (times_s[i] - place_s);
  }
  return grid;
}

}  // namespace ftcs
