// SPDX-License-Identifier: MIT
// World: the paper's Section IV. T = 100 us, reference minus local +21 us at the start, local 1 %
// slow, 51.5 ns of white noise on the receive timestamp. Oracles: the closed forms of the noise
// gain.
#include "ftcs/sim/one_way.h"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/pics_servo.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::sim {
namespace {

constexpr double kSigma = 51.5;

OneWaySpec section_iv(std::uint64_t samples, double sigma = kSigma) {
  OneWaySpec spec;
  spec.interval = Nanoseconds{100'000};
  spec.oscillator.parts = {ConstantSkew{-0.01}};
  spec.initial_offset = Nanoseconds{-21'000};
  spec.timestamp_noise_ns = sigma;
  spec.limits = {Rate::from_ratio(0.1), Rate::from_ratio(1.9)};
  spec.samples = samples;
  return spec;
}

FtcsConfig ftcs(double gain) {
  FtcsConfig config;
  config.sync_interval = Nanoseconds{100'000};
  config.offset_gain = gain;
  config.limits = {Rate::from_ratio(0.1), Rate::from_ratio(1.9)};
  return config;
}

template <class Law>
double true_rms(Law law, std::uint64_t samples) {
  double squares = 0.0;
  std::uint64_t count = 0;
  run_one_way(section_iv(samples), 1, law, [&](const OneWaySample& s) {
    if (s.index < 1000) return;
    squares += s.time_error_ns * s.time_error_ns;
    ++count;
  });
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(OneWay, without_noise_ftcs_is_on_time_one_interval_after_its_first_action) {
  FtcsServo law(ftcs(1.0));
  std::vector<double> errors;
  run_one_way(section_iv(4, 0.0), 1, law,
              [&](const OneWaySample& s) { errors.push_back(s.time_error_ns); });
  EXPECT_NEAR(errors[0], -21'000.0, 1e-6);
  EXPECT_NEAR(errors[1], -22'000.0, 1e-6);  // not yet acted: 1 % of 100 us more
  EXPECT_NEAR(errors[2], 0.0, 1.0);         // the stamps' tick
}

// Variance sigma^2 (2 + 3p) / (2 - p).
TEST(OneWay, ftcs_has_the_noise_gain_of_the_closed_form) {
  for (const double p : {1.0, 0.5, 1.0 / 16.0}) {
    const double expected = kSigma * std::sqrt((2.0 + 3.0 * p) / (2.0 - p));
    EXPECT_NEAR(true_rms(FtcsServo(ftcs(p)), 200'000), expected, 0.01 * expected) << p;
  }
}

TEST(OneWay, a_seed_repeats_itself_to_the_bit) {
  const double first = true_rms(FtcsServo(ftcs(0.5)), 3000);
  const double second = true_rms(FtcsServo(ftcs(0.5)), 3000);
  EXPECT_EQ(first, second);
}

TEST(OneWay, allocates_nothing_once_it_runs) {
  FtcsServo law(ftcs(1.0));
  std::optional<test::ForbidAllocation> guard;
  std::uint64_t seen = 0;
  run_one_way(section_iv(30'000), 1, law, [&](const OneWaySample& s) {
    if (s.index == 10) guard.emplace();
    if (s.index == 29'990) guard.reset();
    ++seen;
  });
  EXPECT_EQ(seen, 30'000U);
}

}  // namespace
}  // namespace ftcs::sim
