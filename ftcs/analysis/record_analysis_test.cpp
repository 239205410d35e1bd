// SPDX-License-Identifier: MIT
// World: a clock with a known frequency offset and white phase noise.
#include "ftcs/analysis/record_analysis.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

TEST(MeanRates, are_differences_over_their_window) {
  const double phase[] = {0.0, 1.0, 4.0, kNoFigure, 8.0};
  const auto rates = mean_rates({phase, 0.5}, 2);
  ASSERT_EQ(rates.size(), 2U);
  EXPECT_EQ(rates[0], 4.0);
  EXPECT_EQ(rates[1], 4.0);
  EXPECT_TRUE(std::isnan(mean_rates({phase, 0.5}, 1)[2]));
}

TEST(AnalyseRecord, separates_frequency_offset_from_noise) {
  auto phase = test::white_noise(4000, 10e-9, 9);
  for (std::size_t i = 0; i < phase.size(); ++i) phase[i] += 1e-6 * static_cast<double>(i);
  const RecordAnalysis analysis = analyse_record({phase, 1.0});
  EXPECT_NEAR(analysis.line.slope, 1e-6, 1e-12);
  EXPECT_NEAR(analysis.line.residual_rms, 10e-9, 0.5e-9);
  EXPECT_NEAR(analysis.points(Deviation::kOverlappingAllan)[0].deviation, std::sqrt(3.0) * 10e-9,
              1e-9);
  EXPECT_EQ(analysis.points(Deviation::kOverlappingAllan).size(), analysis.wander.size());
  EXPECT_EQ(analysis.points(Deviation::kOverlappingAllan)[0].noise, PowerLawNoise::kWhitePhase);
}

}  // namespace
}  // namespace ftcs
