// SPDX-License-Identifier: MIT
// World: the flags that `ftcs ptp` and `ftcs phc` share, parsed as a command line is, and the same
// limits as settings of a configuration file.
#include "apps/ftcs/steering_arguments.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include "apps/ftcs/config_file.h"

namespace ftcs::app {
namespace {

struct Given {
  ServoConfig servo;
  SteeringRules rules;
  std::string wrong;
};

Given given(const std::string& command_line) {
  CLI::App app;
  SteeringArguments arguments;
  add_steering_flags(app, arguments);
  app.parse(command_line);
  Given result;
  auto wrong = choose_servo(arguments, result.servo);
  if (!wrong) wrong = apply_steering(arguments, result.servo, result.rules);
  if (!wrong) wrong = check_steering(result.servo, result.rules);
  result.wrong = wrong.value_or("");
  return result;
}

TEST(SteeringArguments, every_limit_reaches_the_servo) {
  const Given all = given(
      "--max-frequency 500ppm --max-frequency-change 2ppm --frequency-granularity 0.5ppb "
      "--timer-granularity 1ms --steering-latency 50us --never-step");
  EXPECT_EQ(all.wrong, "");
  EXPECT_NEAR(all.servo.limits.fastest.ppm(), 500.0, 1e-6);
  EXPECT_DOUBLE_EQ(all.rules.largest_rate_change, 2e-6);
  EXPECT_DOUBLE_EQ(all.servo.adaptive.steering.rate_granularity, 0.5e-9);
  EXPECT_EQ(all.servo.adaptive.steering.time_granularity, Nanoseconds{1'000'000});
  EXPECT_EQ(all.servo.adaptive.steering.latency, Nanoseconds{50'000});
  EXPECT_TRUE(all.rules.never_step);
}

TEST(SteeringArguments, nothing_given_limits_nothing) {
  const Given none = given("");
  EXPECT_EQ(none.wrong, "");
  EXPECT_EQ(none.rules.largest_rate_change, 0.0);
  EXPECT_EQ(none.servo.adaptive.steering.rate_granularity, 0.0);
  EXPECT_FALSE(none.rules.never_step);
}

TEST(SteeringArguments, a_value_out_of_range_is_named_with_its_range) {
  EXPECT_EQ(given("--max-frequency 0.5ppb").wrong,
            "--max-frequency: 0.5 ppb: expected 1 to 9e+08 ppb, or 0: the clock's own limit");
  EXPECT_EQ(given("--max-frequency-change=-1ppm").wrong,
            "--max-frequency-change: -1000 ppb: expected 0 to 9e+08 ppb");
  EXPECT_EQ(given("--frequency-granularity 200000ppm").wrong,
            "--frequency-granularity: 200000000 ppb: expected 0 to 1e+08 ppb");
  EXPECT_EQ(given("--timer-granularity 2s").wrong,
            "--timer-granularity: 2000000000 ns: expected 0 to 1e+09 ns");
  EXPECT_EQ(given("--steering-latency=-1ns").wrong,
            "--steering-latency: -1 ns: expected 0 to 1e+09 ns");
  EXPECT_NE(given("--steering-latency 5").wrong.find("--steering-latency: '5' is no time"),
            std::string::npos);
}

TEST(SteeringArguments, a_servo_that_cannot_keep_to_a_limit_says_so) {
  EXPECT_EQ(given("--servo linuxptp-pi --max-frequency-change 1ppm").wrong,
            "max_frequency_change: the servo linuxptp-pi cannot keep to it, only adaptive can");
  EXPECT_EQ(given("--servo ftcs --timer-granularity 1us").wrong,
            "timer_granularity: the servo ftcs cannot keep to it, only adaptive can");
  // The limits of every servo, a limit that is none, and a servo that steers nothing.
  EXPECT_EQ(given("--servo pics --max-frequency 10ppm --never-step").wrong, "");
  EXPECT_EQ(given("--servo pics --max-frequency-change 0").wrong, "");
  EXPECT_EQ(given("--servo none --max-frequency-change 1ppm").wrong, "");
}

TEST(SteeringArguments, limits_that_leave_no_rate_to_choose_contradict_each_other) {
  EXPECT_NE(given("--max-frequency 10ppb --frequency-granularity 20ppb").wrong, "");
  EXPECT_NE(given("--max-frequency-change 10ppb --frequency-granularity 10ppb").wrong, "");
  EXPECT_EQ(given("--max-frequency-change 10ppb --frequency-granularity 9ppb").wrong, "");
}

TEST(SteeringSettings, have_ptp4ls_units) {
  daemon::PtpOptions options;
  EXPECT_EQ(read_config_text("[global]\n"
                             "max_frequency 500000\n"
                             "max_frequency_change 2000\n"
                             "frequency_granularity 0.5\n"
                             "timer_granularity 1000000\n"
                             "steering_latency 50000\n"
                             "never_step 1\n",
                             "ptp.conf", options)
                .value_or(""),
            "");
  EXPECT_NEAR(options.follower.servo.limits.fastest.ppb(), 500'000.0, 1e-3);
  EXPECT_DOUBLE_EQ(options.follower.steering.largest_rate_change, 2e-6);
  EXPECT_DOUBLE_EQ(options.follower.servo.adaptive.steering.rate_granularity, 0.5e-9);
  EXPECT_EQ(options.follower.servo.adaptive.steering.time_granularity, Nanoseconds{1'000'000});
  EXPECT_EQ(options.follower.servo.adaptive.steering.latency, Nanoseconds{50'000});
  EXPECT_TRUE(options.follower.steering.never_step);
}

TEST(SteeringSettings, a_max_frequency_of_zero_is_the_clocks_own_limit_as_with_ptp4l) {
  daemon::PtpOptions options;
  EXPECT_EQ(read_config_text("[global]\nmax_frequency 100\nmax_frequency 0\n", "ptp.conf", options),
            std::nullopt);
  // Wider than what is set where nothing is said, so that the clock's own limit alone is left.
  EXPECT_GT(options.follower.servo.limits.fastest, RateLimits{}.fastest);
  EXPECT_LT(options.follower.servo.limits.slowest, RateLimits{}.slowest);
}

TEST(SteeringSettings, errors_name_file_line_and_range) {
  daemon::PtpOptions options;
  EXPECT_EQ(read_config_text("[global]\nmax_frequency_change -1\n", "ptp.conf", options),
            "ptp.conf:2: max_frequency_change: -1 ppb: expected 0 to 9e+08 ppb");
  EXPECT_EQ(read_config_text("[global]\nmax_frequency -1\n", "ptp.conf", options),
            "ptp.conf:2: max_frequency: -1 ppb: expected 1 to 9e+08 ppb, or 0: the clock's own "
            "limit");
  EXPECT_NE(read_config_text("[global]\nsteering_latency soon\n", "ptp.conf", options),
            std::nullopt);
}

}  // namespace
}  // namespace ftcs::app
