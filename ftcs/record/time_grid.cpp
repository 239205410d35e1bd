// SPDX-License-Identifier: MIT
#include "ftcs/record/time_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

Result<GriddedValues, GridError> place_on_grid(std::span<const double> values,
                                               std::span<const double> times_s,
                                               std::optional<double> interval_s) {
  GriddedValues grid;
  if (values.empty()) return grid;
  grid.interval_s = interval_s ? *interval_s : times_s.size() > 1 ? median_step(times_s) : 1.0;
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
