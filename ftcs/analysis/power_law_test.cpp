// SPDX-License-Identifier: MIT
// World: equivalent degrees of freedom against an independent program, chi-squared against its
// table, noise identified in generated records.
#include "ftcs/analysis/power_law.h"

#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"
#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

constexpr VarianceShape kOverlappingAllan{2, false, true};
constexpr VarianceShape kModifiedAllan{2, true, true};
constexpr VarianceShape kOverlappingHadamard{3, false, true};

// allantools 2024.06 edf_greenhall() for N = 1000, m = 10, as published in the tests of the Rust
// library kshana 0.25.
TEST(DegreesOfFreedom, equal_the_figures_of_an_independent_program) {
  EXPECT_NEAR(
      equivalent_degrees_of_freedom(PowerLawNoise::kWhiteFrequency, kModifiedAllan, 10, 1000),
      94.5374886, 1e-4);
  EXPECT_NEAR(
      equivalent_degrees_of_freedom(PowerLawNoise::kWhiteFrequency, kOverlappingHadamard, 10, 1000),
      113.5825926, 1e-4);
  EXPECT_NEAR(
      equivalent_degrees_of_freedom(PowerLawNoise::kWhitePhase, kOverlappingHadamard, 10, 1000),
      422.7434066, 1e-4);
  EXPECT_DOUBLE_EQ(total_degrees_of_freedom(PowerLawNoise::kWhiteFrequency, 10, 1000), 150.0);
}

// White FM makes the phase a random walk, |t| its structure function, so that the covariance of D_i
// at any lag is a sum of five terms and edf = M^2 R(0)^2 / (sum of R^2 over all pairs), by Gaussian
// moments. The algorithm averages the phase over tau_0: a difference of the order 1/m.
TEST(DegreesOfFreedom, meet_the_direct_sum_over_all_pairs_of_terms_for_white_fm) {
  for (const std::size_t m : {16U, 64U, 256U}) {
    constexpr std::size_t kPoints = 1000;
    const auto covariance = [m](std::size_t lag) {
      const double weights[] = {1.0, -4.0, 6.0, -4.0, 1.0};
      double sum = 0.0;
      for (int k = 0; k < 5; ++k) {
        sum -= weights[k] * std::abs(static_cast<double>(lag) + (k - 2) * static_cast<double>(m));
      }
      return sum;
    };
    const std::size_t terms = kPoints - 2 * m;
    const double variance = covariance(0);
    double pairs = static_cast<double>(terms) * variance * variance;
    for (std::size_t lag = 1; lag < terms; ++lag) {
      pairs += 2.0 * static_cast<double>(terms - lag) * covariance(lag) * covariance(lag);
    }
    const double expected = std::pow(static_cast<double>(terms) * variance, 2) / pairs;
    EXPECT_NEAR(equivalent_degrees_of_freedom(PowerLawNoise::kWhiteFrequency, kOverlappingAllan, m,
                                              kPoints),
                expected, expected / static_cast<double>(m));
  }
}

TEST(DegreesOfFreedom, go_over_into_the_limit_of_large_m_without_a_step) {
  for (const auto noise :
       {PowerLawNoise::kRandomWalkFrequency, PowerLawNoise::kFlickerFrequency,
        PowerLawNoise::kWhiteFrequency, PowerLawNoise::kFlickerPhase, PowerLawNoise::kWhitePhase}) {
    for (const auto shape : {kOverlappingAllan, kModifiedAllan, kOverlappingHadamard}) {
      SCOPED_TRACE(name(noise));
      const double full = equivalent_degrees_of_freedom(noise, shape, 1024, 20480);
      const double limit = equivalent_degrees_of_freedom(noise, shape, 1025, 20500);
      EXPECT_NEAR(limit, full, 0.02 * full);
      const double huge = equivalent_degrees_of_freedom(noise, shape, 1000000, 10000000);
      EXPECT_GT(huge, 1.0);
      EXPECT_LT(huge, 1e7);
    }
  }
}

TEST(DegreesOfFreedom, are_none_without_a_term_and_one_with_one) {
  EXPECT_EQ(equivalent_degrees_of_freedom(PowerLawNoise::kWhitePhase, kOverlappingAllan, 10, 20),
            0.0);
  for (const auto noise : {PowerLawNoise::kFlickerPhase, PowerLawNoise::kRandomWalkFrequency}) {
    EXPECT_NEAR(equivalent_degrees_of_freedom(noise, kOverlappingAllan, 10, 21), 1.0, 1e-9);
  }
  EXPECT_EQ(equivalent_degrees_of_freedom(PowerLawNoise::kWhitePhase, kOverlappingAllan, 0, 20),
            0.0);
}

// chi^2 table: 10 degrees of freedom, 5 % and 95 %: 3.940 and 18.307.
TEST(ConfidenceInterval, follows_the_chi_squared_table) {
  const auto interval = confidence_interval(2.0, 10.0, 0.90);
  EXPECT_NEAR(interval.lower, 2.0 * std::sqrt(10.0 / 18.307), 1e-4);
  EXPECT_NEAR(interval.upper, 2.0 * std::sqrt(10.0 / 3.940), 1e-3);
  EXPECT_TRUE(std::isnan(confidence_interval(2.0, 0.0, 0.9).lower));
  EXPECT_TRUE(std::isnan(confidence_interval(kNoFigure, 5.0, 0.9).lower));
}

TEST(IdentifyNoise, names_each_power_law) {
  using test::flicker_noise;
  using test::running_sum;
  using test::white_noise;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto white = white_noise(4096, 1e-9, seed);
    const auto flicker = flicker_noise(4096, 1e-9, seed);
    for (const std::size_t m : {1U, 4U}) {
      EXPECT_EQ(identify_noise(white, m), PowerLawNoise::kWhitePhase);
      EXPECT_EQ(identify_noise(flicker, m), PowerLawNoise::kFlickerPhase);
      EXPECT_EQ(identify_noise(running_sum(white), m), PowerLawNoise::kWhiteFrequency);
      EXPECT_EQ(identify_noise(running_sum(flicker), m), PowerLawNoise::kFlickerFrequency);
      EXPECT_EQ(identify_noise(running_sum(running_sum(white)), m),
                PowerLawNoise::kRandomWalkFrequency);
    }
  }
}

TEST(IdentifyNoise, is_not_fooled_by_a_frequency_offset) {
  auto phase = test::white_noise(1000, 1e-9, 3);
  for (std::size_t i = 0; i < phase.size(); ++i) phase[i] += 1e-6 * static_cast<double>(i);
  EXPECT_EQ(identify_noise(phase, 1), PowerLawNoise::kWhitePhase);
}

}  // namespace
}  // namespace ftcs
