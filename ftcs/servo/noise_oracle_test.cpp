// SPDX-License-Identifier: MIT
// World: white timestamp noise N(n), Gaussian, sigma; a clock on its reference already; T = 100 us
// as in the paper's Section IV. theta = reference - local at the sample instants. Oracles: closed
// forms of the linear model theta(n+1) = -(N(n) - N(n-1)) - p N(n) + (1 - p) theta(n) and the
// incremental PI, neither taken from the servo.
#include <cmath>
#include <vector>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <gtest/gtest.h>

#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/pics_servo.h"
#include "test/support/affine_plant.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

constexpr Nanoseconds kInterval = 100us;
constexpr double kIntervalNs = 100'000.0;
constexpr double kSigmaNs = 51.5;
constexpr std::size_t kSettling = 4'000;  // 30 time constants of p = 1/128

std::vector<double> white_noise(std::size_t count, double sigma_ns, std::uint32_t seed = 1) {
  boost::random::mt19937 engine{seed};
  boost::random::normal_distribution<double> normal{0.0, sigma_ns};
  std::vector<double> noise(count);
  for (double& value : noise) value = normal(engine);
  return noise;
}

FtcsConfig ftcs_with(double offset_gain) {
  FtcsConfig config;
  config.sync_interval = kInterval;
  config.offset_gain = offset_gain;
  config.converged_dwell = 0;
  return config;
}

PicsConfig pics_with(double proportional_gain, double integral_gain) {
  PicsConfig config;
  config.sync_interval = kInterval;
  config.proportional_gain = proportional_gain;
  config.integral_gain = integral_gain;
  return config;
}

struct Errors {
  std::vector<double> perceived;  ///< reference - local, with the noise
  std::vector<double> true_error;
};

/// One sample per noise value. A message that arrives N late carries stamps of N later on both
/// faces of the clock.
template <class Law>
Errors run(Law law, const std::vector<double>& noise) {
  AffinePlant plant{1.0L, Duration{}};
  Errors errors;
  for (const double noise_ns : noise) {
    SyncSample sample = plant.sample();
    sample.local = sample.local + Duration::from_ns(noise_ns);
    sample.free_running = sample.free_running + Duration::from_ns(noise_ns);
    errors.true_error.push_back(-plant.offset_ns());
    errors.perceived.push_back(-sample.offset().ns());
    // Without latency: the command refers to the sample's own stamps.
    const ServoUpdate update = law.update(sample, {sample.free_running, sample.local});
    if (update.has_command) plant.apply(update.command);
    plant.advance_reference(kInterval);
  }
  return errors;
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

Moments moments(const std::vector<double>& values) {
  double sum = 0.0;
  double squares = 0.0;
  const auto count = static_cast<double>(values.size() - kSettling);
  for (std::size_t n = kSettling; n < values.size(); ++n) sum += values[n];
  const double mean = sum / count;
  for (std::size_t n = kSettling; n < values.size(); ++n) {
    squares += (values[n] - mean) * (values[n] - mean);
  }
  return {mean, squares / count};
}

class FtcsNoise : public ::testing::TestWithParam<double> {};

TEST_P(FtcsNoise, variance_and_mean_of_the_true_error_are_the_closed_forms) {
  const double p = GetParam();
  const Errors errors = run(FtcsServo{ftcs_with(p)}, white_noise(400'000, kSigmaNs));
  const double sigma2 = kSigmaNs * kSigmaNs;
  const double expected = sigma2 * (2.0 + 3.0 * p) / (2.0 - p);
  // 1.5 %: three standard errors of the sample variance, correlated over 1/p samples, and the
  // second order.
  EXPECT_NEAR(moments(errors.true_error).variance / expected, 1.0, 0.015);
  EXPECT_NEAR(moments(errors.perceived).variance / (expected + sigma2), 1.0, 0.015);
  // Second order: k(n) = T / (T + V) has the mean 1 + 2 sigma^2/T^2, which weighs 1/p intervals;
  // the rest is the correlation of T_offset and V while a correction is in force (half of the time
  // all of it).
  const double bias = -sigma2 / kIntervalNs * (2.0 / p + (2.0 + p) / 2.0);
  const double standard_error =
      kSigmaNs / std::sqrt(400'000.0);  // N passes to theta with gain 1 at DC
  EXPECT_NEAR(moments(errors.true_error).mean, bias, 0.02 * std::abs(bias) + 3.0 * standard_error);
}

INSTANTIATE_TEST_SUITE_P(table_2, FtcsNoise,
                         ::testing::Values(1.0, 1.0 / 2.0, 1.0 / 16.0, 1.0 / 64.0, 1.0 / 128.0));

TEST(FtcsServo, without_offset_gain_scatters_by_sqrt_2_sigma_about_its_own_mean) {
  // In blocks of 300 samples, the paper's length: the bias of k(n) lets the mean creep by 2
  // sigma^2/T = 0.05 ns per interval, so that it is "frozen" for a while only.
  constexpr std::size_t kBlock = 300;
  const Errors errors = run(FtcsServo{ftcs_with(0.0)}, white_noise(300'000, kSigmaNs));
  double variance = 0.0;
  double blocks = 0.0;
  for (std::size_t start = 0; start < errors.perceived.size(); start += kBlock) {
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t n = start; n < start + kBlock; ++n) sum += errors.perceived[n];
    for (std::size_t n = start; n < start + kBlock; ++n) {
      const double deviation = errors.perceived[n] - sum / kBlock;
      squares += deviation * deviation;
    }
    variance += squares / (kBlock - 1);
    blocks += 1.0;
  }
  EXPECT_NEAR(std::sqrt(variance / blocks) / kSigmaNs, std::sqrt(2.0), 0.014);
  const double creep = (errors.true_error.back() - errors.true_error.front()) / 300'000.0;
  EXPECT_NEAR(creep, -2.0 * kSigmaNs * kSigmaNs / kIntervalNs, 0.002);
}

TEST(FtcsServo, answers_one_late_stamp_with_plus_2_then_minus_1) {
  std::vector<double> late(8, 0.0);
  late[4] = 10.0;
  const std::vector<double> expected{0.0, 0.0, 0.0, 0.0, 0.0, 20.0, -10.0, 0.0};
  const Errors ftcs = run(FtcsServo{ftcs_with(1.0)}, late);
  const Errors pics = run(PicsServo{pics_with(1.0, 1.0)}, late);
  constexpr double kSecondOrder = 5.0 * 10.0 * 10.0 / kIntervalNs;
  for (std::size_t n = 0; n < late.size(); ++n) {
    EXPECT_NEAR(ftcs.true_error[n], expected[n], kSecondOrder) << n;
    EXPECT_NEAR(pics.true_error[n], expected[n], kSecondOrder) << n;
  }
}

double rms_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0.0;
  for (std::size_t n = kSettling; n < a.size(); ++n) squares += (a[n] - b[n]) * (a[n] - b[n]);
  return std::sqrt(squares / static_cast<double>(a.size() - kSettling));
}

TEST(FtcsServo, equals_the_incremental_pi_to_second_order) {
  for (const double p : {1.0, 1.0 / 2.0, 1.0 / 64.0}) {
    const auto difference_at = [p](double sigma_ns) {
      const std::vector<double> noise = white_noise(50'000, sigma_ns);
      return rms_difference(run(FtcsServo{ftcs_with(p)}, noise).true_error,
                            run(PicsServo{pics_with(1.0, p)}, noise).true_error);
    };
    const double whole = difference_at(kSigmaNs);
    const double half = difference_at(kSigmaNs / 2.0);
    // In units of sigma^2 / T = 0.027 ns: the bias 2/p of k(n), and a few for everything else.
    EXPECT_LT(whole, (2.0 / p + 6.0) * kSigmaNs * kSigmaNs / kIntervalNs) << p;
    EXPECT_NEAR(whole / half, 4.0, 0.2) << p;  // second order: a quarter at half the noise
  }
}

}  // namespace
}  // namespace ftcs
