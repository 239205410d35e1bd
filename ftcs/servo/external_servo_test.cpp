// SPDX-License-Identifier: MIT
// A servo behind the C interface, written here: what it is shown, and what becomes of its commands.
#include "ftcs/servo/external_servo.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/servo/any_servo.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;

struct Recorder {
  std::vector<ftcs_servo_observation> seen;
  ftcs_servo_command command{};
  std::int32_t result = FTCS_SERVO_HEARD;
  int resets = 0;
};

Recorder* of(void* servo) { return static_cast<Recorder*>(servo); }

std::int32_t update(void* servo, const ftcs_servo_observation* seen, ftcs_servo_command* command) {
  of(servo)->seen.push_back(*seen);
  *command = of(servo)->command;
  return of(servo)->result;
}

void reset(void* servo) { ++of(servo)->resets; }

void believe(const void*, ftcs_servo_belief* belief) {
  belief->offset_ns = 7.0;
  belief->offset_sigma_ns = 2.0;
}

ftcs_servo_functions functions() {
  return {FTCS_SERVO_ABI, "recorder", nullptr, nullptr, &reset, &update, nullptr};
}

/// Two clocks at one rate, local 100 ns ahead, 1 us of path in each direction.
TimestampPair message(Direction direction, Nanoseconds at) {
  const bool forward = direction == Direction::kForward;
  const Nanoseconds reference = forward ? at - 1us : at + 1us;
  return {direction, ReferenceTime{reference}, LocalTime{at + 100ns}, FreeRunningTime{at}};
}

ClockReading reading(Nanoseconds at) { return {FreeRunningTime{at}, LocalTime{at + 100ns}}; }

class External : public testing::Test {
 protected:
  ExternalServo servo() { return ExternalServo{config_}; }

  Recorder recorder_;
  ftcs_servo_functions functions_ = functions();
  ExternalConfig config_{&functions_, &recorder_, {}, {}};
};

TEST_F(External, is_shown_stamps_of_three_clocks_and_the_clocks_of_now) {
  config_.fixed_path_delay = 1us;
  auto servo = this->servo();
  TimestampPair pair = message(Direction::kForward, 5s);
  pair.local = LocalTime{Duration::from_ns(0.25)} + Duration{5s};
  servo.update(pair, reading(6s));
  ASSERT_EQ(recorder_.seen.size(), 1U);
  const auto& seen = recorder_.seen.front();
  EXPECT_EQ(seen.direction, FTCS_SERVO_FORWARD);
  EXPECT_EQ(seen.reference.ns, 4'999'999'000);
  EXPECT_EQ(seen.local.ns, 5'000'000'000);
  EXPECT_DOUBLE_EQ(seen.local.fraction_ns, 0.25);
  EXPECT_EQ(seen.free_running.ns, 5'000'000'000);
  EXPECT_EQ(seen.now_local.ns, 6'000'000'100);
  EXPECT_EQ(seen.now_free_running.ns, 6'000'000'000);
  EXPECT_DOUBLE_EQ(seen.path_delay_ns, 1000.0);
  EXPECT_DOUBLE_EQ(seen.offset_ns, 0.25);
}

TEST_F(External, knows_no_offset_before_a_path_delay_and_none_of_a_backward_message) {
  auto servo = this->servo();
  for (int n = 0; n < 3; ++n) {
    const Nanoseconds at = 1s * (n + 1);
    servo.update(message(Direction::kForward, at), reading(at));
    servo.update(message(Direction::kBackward, at + 10ms), reading(at + 10ms));
  }
  ASSERT_EQ(recorder_.seen.size(), 6U);
  EXPECT_TRUE(std::isnan(recorder_.seen[0].offset_ns));
  EXPECT_TRUE(std::isnan(recorder_.seen[0].path_delay_ns));
  EXPECT_EQ(recorder_.seen[5].direction, FTCS_SERVO_BACKWARD);
  EXPECT_TRUE(std::isnan(recorder_.seen[5].offset_ns));
  EXPECT_NEAR(recorder_.seen[4].path_delay_ns, 1000.0, 1e-3);
  EXPECT_NEAR(recorder_.seen[4].offset_ns, 100.0, 1e-3);
  EXPECT_TRUE(servo.snapshot().offset_known);
}

TEST_F(External, commands_the_clock_only_when_it_says_so) {
  auto servo = this->servo();
  recorder_.command = {1500.0, 1e9, -500.0, 3.0};
  EXPECT_FALSE(servo.update(message(Direction::kForward, 1s), reading(1s)).has_command);
  recorder_.result = FTCS_SERVO_COMMAND;
  const ServoUpdate update = servo.update(message(Direction::kForward, 2s), reading(2s));
  ASSERT_TRUE(update.has_command);
  EXPECT_NEAR(update.command.correction_rate.ppb(), 1500.0, 1e-6);
  EXPECT_DOUBLE_EQ(update.command.correction_time.ns(), 1e9);
  EXPECT_NEAR(update.command.tracking_rate.ppb(), -500.0, 1e-6);
  EXPECT_DOUBLE_EQ(update.command.step.ns(), 3.0);
  EXPECT_EQ(servo.snapshot().state, ServoState::kLocked);
}

TEST_F(External, counts_what_it_rejects) {
  auto servo = this->servo();
  recorder_.result = FTCS_SERVO_REJECTED;
  const ServoUpdate update = servo.update(message(Direction::kForward, 1s), reading(1s));
  EXPECT_EQ(update.verdict, SampleVerdict::kRejected);
  EXPECT_FALSE(update.has_command);
}

TEST_F(External, cannot_command_what_is_no_number_or_a_time_before_now) {
  recorder_.result = FTCS_SERVO_COMMAND;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  for (const ftcs_servo_command& command :
       {ftcs_servo_command{kNan, 0, 0, 0}, ftcs_servo_command{0, -1, 0, 0},
        ftcs_servo_command{0, 0, kInfinite, 0}, ftcs_servo_command{0, 0, 0, kNan},
        ftcs_servo_command{0, kInfinite, 0, 0}}) {
    auto servo = this->servo();
    recorder_.command = command;
    const ServoUpdate update = servo.update(message(Direction::kForward, 1s), reading(1s));
    EXPECT_FALSE(update.has_command);
    EXPECT_EQ(update.verdict, SampleVerdict::kImplausible);
  }
}

TEST_F(External, is_told_of_a_new_reference_and_forgets_the_path_delay) {
  auto servo = this->servo();
  for (int n = 0; n < 3; ++n) {
    const Nanoseconds at = 1s * (n + 1);
    servo.update(message(Direction::kForward, at), reading(at));
    servo.update(message(Direction::kBackward, at + 10ms), reading(at + 10ms));
  }
  servo.reset();
  EXPECT_EQ(recorder_.resets, 1);
  servo.update(message(Direction::kForward, 9s), reading(9s));
  EXPECT_TRUE(std::isnan(recorder_.seen.back().path_delay_ns));
}

TEST_F(External, may_say_what_it_believes) {
  functions_.believe = &believe;
  const ServoSnapshot snapshot = servo().snapshot();
  EXPECT_DOUBLE_EQ(snapshot.offset.ns(), 7.0);
  EXPECT_DOUBLE_EQ(snapshot.offset_sigma_ns, 2.0);
}

TEST_F(External, needs_functions_and_an_instance) {
  ServoConfig config;
  config.kind = ServoKind::kExternal;
  EXPECT_EQ(validate(config), ServoConfigError::kExternal);
  config.external = config_;
  EXPECT_EQ(validate(config), std::nullopt);
  config.two_way.fixed_path_delay = 5us;
  AnyServo any = make_servo(config);
  any.update(message(Direction::kForward, 1s), reading(1s));
  EXPECT_DOUBLE_EQ(recorder_.seen.back().path_delay_ns, 5000.0);
}

}  // namespace
}  // namespace ftcs
