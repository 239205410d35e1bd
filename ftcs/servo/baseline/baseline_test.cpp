// SPDX-License-Identifier: MIT
// World: an oscillator 50 ppm fast, one forward message a second over a known path, 100 ns of white
// noise.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/servo/baseline/frequency_compensated_servo.h"
#include "ftcs/servo/baseline/kalman_filter.h"
#include "ftcs/servo/baseline/pid_servo.h"
#include "ftcs/servo/baseline/regression_servo.h"

namespace ftcs {
namespace {

// Steady state of the constant-velocity filter (tracking index Lambda = q T^3 / R, Kalata 1984):
// with g = gain of x, Lambda = b^2 / (1 - g), b = 2 (2 - g) - 4 sqrt(1 - g).
TEST(KalmanFilter, reaches_the_gain_of_the_alpha_beta_filter) {
  baseline::KalmanNoise noise;
  noise.forward_ns = 100.0;
  noise.random_walk_fm_1s = 1e-9;
  baseline::KalmanFilter filter(noise, true);
  for (int i = 0; i < 3000; ++i) filter.update(1.0, 1.0, 0.0);
  const double g = filter.gain();
  // Continuous white acceleration, steady state: P from the algebraic Riccati equation, iterated
  // here by hand.
  double xx = 1.0;
  double xy = 0.0;
  double yy = 1.0;
  double gain = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double px = xx + 2.0 * xy + yy + 1.0 / 3.0;
    const double pxy = xy + yy + 0.5;
    const double py = yy + 1.0;
    gain = px / (px + 1e4);
    xx = (1.0 - gain) * px;
    xy = (1.0 - gain) * pxy;
    yy = py - pxy * pxy / (px + 1e4);
  }
  EXPECT_NEAR(g, gain, 1e-6);
}

// Without process noise the filter is the least-squares line: variance of its end 2 (2n - 1) / (n
// (n + 1)) sigma^2.
TEST(KalmanFilter, without_process_noise_is_the_least_squares_line) {
  baseline::KalmanNoise noise;
  noise.forward_ns = 100.0;
  noise.random_walk_fm_1s = 0.0;
  baseline::KalmanFilter filter(noise, true);
  const int n = 50;
  for (int i = 0; i < n; ++i) filter.update(1.0, 1.0, 0.0);
  const double expected = 100.0 * std::sqrt(2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)));
  EXPECT_NEAR(filter.offset_sigma_ns(), expected, 1e-3 * expected);
}

TEST(KalmanFilter, tells_delay_from_offset_by_the_two_directions) {
  baseline::KalmanFilter filter(baseline::KalmanNoise{}, false);
  for (int i = 0; i < 400; ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    filter.update(0.5, sign, 700.0 + sign * 10'000.0);
  }
  EXPECT_NEAR(filter.state().x, 700.0, 0.5);
  EXPECT_NEAR(filter.state().d, 10'000.0, 0.5);
}

/// One-way plant with exact steering: RMS of the true offset over the last half.
template <class Law>
double steady_rms(Law law, int samples) {
  std::mt19937_64 engine(5);
  std::normal_distribution<double> noise(0.0, 100.0);
  double free_ns = 0.0;
  double local_ns = 20'000.0;
  double rate = 1.0;
  double squares = 0.0;
  for (int i = 0; i < samples; ++i) {
    const std::int64_t reference_ns = std::int64_t{1'000'000'000} * i;
    const double n = noise(engine);
    const SyncSample sample{ReferenceTime::from_ns(reference_ns), Duration{},
                            LocalTime{Duration::from_ns(local_ns + n)},
                            FreeRunningTime{Duration::from_ns(free_ns + n)}};
    const ClockReading now{FreeRunningTime{Duration::from_ns(free_ns)},
                           LocalTime{Duration::from_ns(local_ns)}};
    const ServoUpdate update = law.update(sample, now);
    if (update.has_command) rate = update.command.correction_rate.ratio();
    const double error = local_ns - static_cast<double>(reference_ns);
    if (i >= samples / 2) squares += error * error;
    const double step_ns = 1e9 * (1.0 + 50e-6);
    free_ns += step_ns;
    local_ns += rate * step_ns;
  }
  return std::sqrt(squares / (samples - samples / 2));
}

// End of a line through 64 points of noise sigma: 2 sigma / sqrt(64) a sample; one interval later
// it has moved on by as much as the slope is wrong. Plain least squares gives 0.25 to 0.27 sigma.
TEST(RegressionServo, averages_as_a_line_through_its_longest_window_does) {
  const double rms = steady_rms(RegressionServo{}, 4000);
  EXPECT_GT(rms, 18.0);
  EXPECT_LT(rms, 30.0);
}

// sqrt(5) sigma at the sample points, the noise gain of FTCS with p = 1, whose ancestor it is.
TEST(FrequencyCompensatedServo, has_the_noise_gain_of_ftcs_with_full_weight) {
  EXPECT_NEAR(steady_rms(FrequencyCompensatedServo{}, 20'000), 223.6, 5.0);
}

// K_p = K_i = 1, K_d = 0 is the paper's optimal PI: sqrt(5) sigma again.
TEST(PidServo, without_a_derivative_part_is_the_incremental_pi) {
  PidConfig config;
  config.proportional_gain = 1.0;
  config.integral_gain = 1.0;
  config.derivative_gain = 0.0;
  EXPECT_NEAR(steady_rms(PidServo{config}, 20'000), 223.6, 5.0);
}

// Ten seconds of a jump are no offset that the oscillator made: the rate stays, and the next sample
// is a first one.
TEST(PidServo, does_not_act_on_a_sample_that_cannot_be_true) {
  PidServo servo{{.sync_interval = Nanoseconds{1'000'000'000}}};
  const auto at = [](double reference_s, double local_s) {
    SyncSample sample;
    sample.origin = ReferenceTime::from_ns(static_cast<std::int64_t>(reference_s * 1e9));
    sample.local = LocalTime::from_ns(static_cast<std::int64_t>(local_s * 1e9));
    sample.free_running = FreeRunningTime::from_ns(static_cast<std::int64_t>(local_s * 1e9));
    return sample;
  };
  (void)servo.update(at(1.0, 1.0), {});
  const ServoUpdate before = servo.update(at(2.0, 2.0 + 1e-6), {});
  ASSERT_TRUE(before.has_command);
  const ServoUpdate jumped = servo.update(at(13.0, 3.0), {});
  EXPECT_EQ(jumped.verdict, SampleVerdict::kImplausible);
  EXPECT_FALSE(jumped.has_command);
  EXPECT_EQ(servo.snapshot().rate_ratio, before.command.tracking_rate);
  const ServoUpdate next = servo.update(at(14.0, 14.0), {});
  ASSERT_TRUE(next.has_command);
  EXPECT_EQ(next.command.tracking_rate, before.command.tracking_rate) << "no kick";
}

}  // namespace
}  // namespace ftcs
