// SPDX-License-Identifier: MIT
// World: Sync and Delay_Req between two affine clocks over a path of 10 us each way; the oscillator
// is 50 ppm fast; a Delay_Req follows each Sync by 40 ms. Commands are applied at once. offset =
// local - reference.
#include "ftcs/servo/two_way_servo.h"

#include <cmath>

#include <gtest/gtest.h>

#include "ftcs/servo/free_running_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/in_order.h"
#include "ftcs/servo/pics_servo.h"
#include "test/support/affine_plant.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

constexpr Nanoseconds kInterval = 125ms;
constexpr Nanoseconds kTurnaround = 40ms;
constexpr Nanoseconds kPath = 10us;

FtcsConfig ftcs_config() {
  FtcsConfig config;
  config.sync_interval = kInterval;
  config.offset_gain = 0.25;
  return config;
}

template <class Servo>
class Exchange {
 public:
  Exchange(Servo servo, Nanoseconds offset)
      : servo_(servo), plant_(1.0L / (1.0L + 50e-6L), offset) {}

  /// A Sync that is `late` on its way.
  ServoUpdate sync(Duration late = {}) {
    const TimestampPair pair{Direction::kForward, plant_.reference() + jump_ - kPath - late,
                             plant_.local(), plant_.free_running()};
    return feed(pair);
  }
  ServoUpdate delay_request() {
    const TimestampPair pair{Direction::kBackward, plant_.reference() + jump_ + kPath,
                             plant_.local(), plant_.free_running()};
    return feed(pair);
  }
  ServoUpdate feed(const TimestampPair& pair) {
    const ServoUpdate update = servo_.update(pair, plant_.read());
    if (update.has_command) plant_.apply(update.command);
    return update;
  }
  /// One whole interval; returns what the Sync came to.
  ServoUpdate cycle(Duration late = {}) {
    const ServoUpdate update = sync(late);
    plant_.advance_reference(kTurnaround);
    delay_request();
    plant_.advance_reference(kInterval - kTurnaround);
    return update;
  }

  Servo& servo() { return servo_; }
  AffinePlant& plant() { return plant_; }
  void jump(Duration by) { jump_ += by; }
  [[nodiscard]] double offset_ns() const {
    return (plant_.local().since_epoch() - plant_.reference().since_epoch() - jump_).ns();
  }

 private:
  Servo servo_;
  AffinePlant plant_;
  Duration jump_{};
};

TEST(TwoWayServo, ftcs_acts_on_the_second_sync_although_the_delay_is_new) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 1ms};
  EXPECT_FALSE(exchange.cycle().has_command);
  EXPECT_FALSE(exchange.servo().snapshot().offset_known);
  EXPECT_TRUE(exchange.cycle().has_command);
  EXPECT_TRUE(exchange.servo().snapshot().offset_known);
  EXPECT_NEAR(exchange.servo().snapshot().path_delay.ns(), 10'000.0, 1e-3);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-3);
  exchange.cycle();
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-3);
}

TEST(TwoWayServo, does_nothing_while_the_path_delay_is_unknown) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 1ms};
  for (int n = 0; n < 5; ++n) {
    const ServoUpdate update = exchange.sync();
    EXPECT_FALSE(update.has_command);
    EXPECT_EQ(update.verdict, SampleVerdict::kUsed);
    EXPECT_FALSE(exchange.servo().snapshot().offset_known);
    exchange.plant().advance_reference(kInterval);
  }
}

TEST(TwoWayServo, a_fixed_path_delay_needs_no_backward_messages) {
  TwoWayConfig config;
  config.fixed_path_delay = kPath;
  Exchange exchange{TwoWayServo<FtcsServo>{config, ftcs_config()}, 1ms};
  exchange.sync();
  EXPECT_TRUE(exchange.servo().snapshot().offset_known);
  exchange.plant().advance_reference(kInterval);
  EXPECT_FALSE(exchange.delay_request().has_command);
  EXPECT_TRUE(exchange.sync().has_command);
  EXPECT_EQ(exchange.servo().snapshot().path_delay, Duration{kPath});
  exchange.plant().advance_reference(kInterval);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-3);
}

TEST(TwoWayServo, a_backward_message_never_commands_and_an_absurd_one_is_reported) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 0ns};
  exchange.cycle();
  exchange.cycle();
  EXPECT_EQ(exchange.delay_request().verdict, SampleVerdict::kUsed);
  for (const Duration wrong : {Duration{1s}, Duration{-1ms}}) {
    const ServoUpdate update =
        exchange.feed({Direction::kBackward, exchange.plant().reference() + wrong,
                       exchange.plant().local(), exchange.plant().free_running()});
    EXPECT_EQ(update.verdict, SampleVerdict::kImplausible);
    EXPECT_FALSE(update.has_command);
  }
  EXPECT_NEAR(exchange.servo().snapshot().path_delay.ns(), 10'000.0, 1e-3);
}

TEST(TwoWayServo, an_answer_without_a_question_near_to_it_tells_no_path_delay) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 0ns};
  EXPECT_EQ(exchange.delay_request().verdict, SampleVerdict::kRejected) << "no Sync at all";
  exchange.sync();
  exchange.plant().advance_reference(Nanoseconds{17s});
  EXPECT_EQ(exchange.delay_request().verdict, SampleVerdict::kRejected) << "17 s after it";
  EXPECT_FALSE(exchange.servo().path_delay_known());
  exchange.sync();
  EXPECT_EQ(exchange.delay_request().verdict, SampleVerdict::kUsed);
  EXPECT_TRUE(exchange.servo().path_delay_known());
}

TEST(TwoWayServo, a_rejected_message_never_steers) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 1ms};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  const ServoSnapshot before = exchange.servo().snapshot();
  const ServoUpdate update = exchange.cycle(Nanoseconds{100us});
  EXPECT_EQ(update.verdict, SampleVerdict::kRejected);
  EXPECT_FALSE(update.has_command);
  EXPECT_EQ(exchange.servo().snapshot().offset, before.offset);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-3);
  EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kUsed);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-3);
  EXPECT_NEAR(exchange.servo().snapshot().path_delay.ns(), 10'000.0, 1e-3);
}

TEST(TwoWayServo, without_the_gate_an_outlier_steers) {
  TwoWayConfig config;
  config.gate_enabled = false;
  Exchange exchange{TwoWayServo<FtcsServo>{config, ftcs_config()}, 0ns};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  EXPECT_TRUE(exchange.cycle(Nanoseconds{100us}).has_command);
  EXPECT_GT(std::abs(exchange.offset_ns()), 10'000.0);
}

TEST(TwoWayServo, steering_does_not_look_like_an_outlier) {
  // PICS (1, 1) from a large skew: its rate swings by thousands of ppm while the gate warms up and
  // after.
  PicsConfig config;
  config.sync_interval = kInterval;
  Exchange exchange{TwoWayServo<PicsServo>{{}, config}, 3ms};
  for (int n = 0; n < 12; ++n) EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kUsed) << n;
  exchange.plant().apply(
      {Rate::from_ppm(5000.0), Duration{}, Rate::from_ppm(5000.0), Duration{Nanoseconds{1ms}}});
  for (int n = 0; n < 6; ++n) EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kUsed) << n;
}

TEST(TwoWayServo, follows_a_true_step_of_the_reference_with_full_weight) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 0ns};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  exchange.jump(Nanoseconds{20us});
  const std::size_t to_exit = OutlierGateConfig{}.rejections_to_exit;
  for (std::size_t n = 1; n < to_exit; ++n) {
    EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kRejected);
    EXPECT_NEAR(exchange.offset_ns(), -20'000.0, 1e-2);  // keeps the tracking rate meanwhile
  }
  EXPECT_EQ(exchange.cycle().verdict,
            SampleVerdict::kUsed);  // the gate gives way; the law starts anew
  EXPECT_TRUE(exchange.cycle().has_command);
  EXPECT_EQ(exchange.servo().snapshot().offset_gain, 1.0);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-2);
}

TEST(TwoWayServo, repetitions_and_late_messages_are_duplicates) {
  TwoWayConfig config;
  config.fixed_path_delay = kPath;
  Exchange exchange{InOrder<TwoWayServo<FtcsServo>>{config, ftcs_config()}, 0ns};
  const TimestampPair early{Direction::kForward, exchange.plant().reference(),
                            exchange.plant().local(), exchange.plant().free_running()};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  exchange.sync();
  EXPECT_EQ(exchange.sync().verdict, SampleVerdict::kDuplicate);
  EXPECT_EQ(exchange.feed(early).verdict, SampleVerdict::kDuplicate);
  exchange.plant().advance_reference(kInterval);
  EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kUsed);
  EXPECT_NEAR(exchange.offset_ns(), 0.0, 1e-2);
}

TEST(TwoWayServo, a_transmitter_that_jumps_by_a_second_is_followed_after_the_gate_gave_way) {
  for (const Nanoseconds jump : {1s, -1s}) {
    Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 0ns};
    for (int n = 0; n < 12; ++n) exchange.cycle();
    exchange.jump(jump);
    int intervals = 0;
    for (; intervals < 400 && std::abs(exchange.offset_ns()) > 1.0; ++intervals) exchange.cycle();
    EXPECT_LT(intervals, 400) << "offset " << exchange.offset_ns();
  }
}

TEST(TwoWayServo, newer_on_neither_clock_is_a_duplicate) {
  Exchange exchange{InOrder<TwoWayServo<FtcsServo>>{TwoWayConfig{}, ftcs_config()}, 0ns};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  exchange.sync();
  const ReferenceTime reference = exchange.plant().reference() - kPath;
  const FreeRunningTime free_running = exchange.plant().free_running();
  const LocalTime local = exchange.plant().local();
  const Duration before = Nanoseconds{1ms};
  for (const TimestampPair& pair :
       {TimestampPair{Direction::kForward, reference, local, free_running - before},
        TimestampPair{Direction::kForward, reference - before, local, free_running},
        TimestampPair{Direction::kForward, reference, local, free_running}}) {
    const ServoUpdate update = exchange.feed(pair);
    EXPECT_EQ(update.verdict, SampleVerdict::kDuplicate);
    EXPECT_FALSE(update.has_command);
  }
  // Newer on one clock is no repetition, whatever else it may be.
  const TimestampPair jumped{Direction::kForward, reference + Nanoseconds{1s}, local, free_running};
  EXPECT_EQ(exchange.feed(jumped).verdict, SampleVerdict::kImplausible);
}

TEST(TwoWayServo, clocks_may_start_before_their_epoch) {
  TwoWayServo<FreeRunningServo> servo{{}, {}};
  const TimestampPair pair{Direction::kForward, ReferenceTime::from_ns(-5'000),
                           LocalTime::from_ns(-5'000), FreeRunningTime::from_ns(-5'000)};
  EXPECT_EQ(servo.update(pair, {}).verdict, SampleVerdict::kUsed);
}

TEST(TwoWayServo, without_rate_compensation_there_is_no_prediction_and_no_gate) {
  TwoWayConfig config;
  config.path_delay.rate_compensated = false;
  Exchange exchange{TwoWayServo<FtcsServo>{config, ftcs_config()}, 0ns};
  for (int n = 0; n < 12; ++n) exchange.cycle();
  EXPECT_TRUE(exchange.cycle(Nanoseconds{100us}).has_command);
}

TEST(TwoWayServo, reset_forgets_the_path_delay) {
  Exchange exchange{TwoWayServo<FreeRunningServo>{{}, {}}, 0ns};
  exchange.cycle();
  exchange.cycle();
  EXPECT_TRUE(exchange.servo().snapshot().offset_known);
  exchange.servo().reset();
  EXPECT_FALSE(exchange.servo().snapshot().offset_known);
  EXPECT_EQ(exchange.servo().snapshot().path_delay, Duration{});
  exchange.jump(Nanoseconds{-3s});
  EXPECT_EQ(exchange.cycle().verdict, SampleVerdict::kUsed);
}

TEST(TwoWayServo, allocates_nothing) {
  Exchange exchange{TwoWayServo<FtcsServo>{{}, ftcs_config()}, 1ms};
  const test::ForbidAllocation guard;
  for (int n = 0; n < 50; ++n) exchange.cycle(n % 10 == 9 ? Nanoseconds{1ms} : Nanoseconds{0});
  exchange.servo().reset();
}

}  // namespace
}  // namespace ftcs
