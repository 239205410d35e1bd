// SPDX-License-Identifier: MIT
// World: cells of one second; noise of 1e-9, estimated over 20,000 to 40,000 cells.
#include "ftcs/sim/frequency_source.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

std::vector<double> cells(FrequencyPart part, int count, double length = 1.0) {
  FrequencySource source({std::move(part)}, 11, 0);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(source.next(i * length, length));
  return values;
}

/// Allan deviation of frequency data at m cells (NIST SP 1065, eq. 8, non-overlapping).
double adev(const std::vector<double>& y, std::size_t m) {
  double sum = 0.0;
  std::size_t count = 0;
  double previous = 0.0;
  for (std::size_t block = 0; (block + 1) * m <= y.size(); ++block) {
    double mean = 0.0;
    for (std::size_t i = 0; i < m; ++i) mean += y[block * m + i];
    mean /= static_cast<double>(m);
    if (block > 0) {
      sum += (mean - previous) * (mean - previous);
      ++count;
    }
    previous = mean;
  }
  return std::sqrt(sum / (2.0 * static_cast<double>(count)));
}

TEST(FrequencySource, white_fm_has_its_allan_deviation_and_falls_with_the_root_of_time) {
  const auto y = cells(WhiteFm{1e-9}, 40'000);
  EXPECT_NEAR(adev(y, 1), 1e-9, 2e-11);
  EXPECT_NEAR(adev(y, 16), 1e-9 / 4.0, 1e-11);
}

TEST(FrequencySource, white_fm_does_not_depend_on_the_grid) {
  const auto y = cells(WhiteFm{1e-9}, 40'000, 0.25);
  EXPECT_NEAR(adev(y, 4), 1e-9, 3e-11);
}

TEST(FrequencySource, flicker_fm_has_a_flat_allan_deviation_at_its_floor) {
  const auto y = cells(FlickerFm{1e-9}, 40'000);
  for (const std::size_t m : {4U, 16U, 64U, 256U}) {
    EXPECT_NEAR(adev(y, m), 1e-9, m < 100 ? 1e-10 : 2e-10) << m;
  }
}

// NIST SP 1065, table of power laws: random-walk FM of step b per second has sigma_y(tau) = b
// sqrt(tau / 3).
TEST(FrequencySource, random_walk_fm_rises_with_the_root_of_time) {
  const auto y = cells(RandomWalkFm{1e-9}, 40'000);
  EXPECT_NEAR(adev(y, 64), 1e-9 * std::sqrt(64.0 / 3.0), 5e-10);
}

TEST(FrequencySource, square_wave_is_a_step_of_twice_its_amplitude_every_half_period) {
  const auto y = cells(FrequencySquare{1e-6, 50.0, false}, 200);
  EXPECT_DOUBLE_EQ(y[49], 1e-6);
  EXPECT_DOUBLE_EQ(y[50], -1e-6);
  EXPECT_NEAR(y[120], 1e-6, 1e-18);
}

TEST(FrequencySource, square_wave_of_random_phase_has_mean_zero_over_whole_periods) {
  double sum = 0.0;
  for (const double y : cells(FrequencySquare{1e-6, 50.0, true}, 300)) sum += y;
  EXPECT_NEAR(sum, 0.0, 1e-16);
}

TEST(FrequencySource, sine_and_ramp_and_step_and_ageing_are_means_over_the_cell) {
  EXPECT_NEAR(cells(FrequencySine{1.0, 4.0, 0.0, false}, 1)[0], 2.0 / 3.14159265358979, 1e-12);
  EXPECT_DOUBLE_EQ(cells(FrequencyRamp{0.5, 1.5, 1.0}, 3)[0], 0.125);
  EXPECT_DOUBLE_EQ(cells(FrequencyRamp{0.5, 1.5, 1.0}, 3)[1], 0.875);
  EXPECT_DOUBLE_EQ(cells(FrequencyRamp{0.5, 1.5, 1.0}, 3)[2], 1.0);
  EXPECT_DOUBLE_EQ(cells(FrequencyStep{0.25, 1.0}, 2)[0], 0.75);
  EXPECT_DOUBLE_EQ(cells(Ageing{2.0}, 2)[1], 3.0);
}

TEST(FrequencySource, replays_a_phase_record_and_holds_the_last_frequency) {
  const auto y = cells(replay_phase({0.0, 2.0, 3.0}, 2.0), 6);
  EXPECT_EQ(y, (std::vector<double>{1.0, 1.0, 0.5, 0.5, 0.5, 0.5}));
}

}  // namespace
}  // namespace ftcs::sim
