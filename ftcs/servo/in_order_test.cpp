// SPDX-License-Identifier: MIT
// World: a reference in step with the oscillator, a message a second, and somebody who repeats,
// overtakes, makes up or sets a clock back. What holds for one servo holds for each of them.
#include "ftcs/servo/in_order.h"

#include <memory>

#include <gtest/gtest.h>

#include "ftcs/servo/any_servo.h"

namespace ftcs {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TimestampPair pair_at(std::int64_t reference_ns, std::int64_t free_ns) {
  return {Direction::kForward, ReferenceTime::from_ns(reference_ns), LocalTime::from_ns(free_ns),
          FreeRunningTime::from_ns(free_ns)};
}

class EveryServo : public ::testing::TestWithParam<ServoKind> {
 protected:
  void SetUp() override {
    ServoConfig config;
    config.kind = GetParam();
    config.two_way.fixed_path_delay = Nanoseconds{0};
    config.adaptive.fixed_path_delay = config.kalman.fixed_path_delay = Nanoseconds{0};
    servo_ = std::make_unique<AnyServo>(make_servo(config));
  }
  ServoUpdate feed(std::int64_t reference_ns, std::int64_t free_ns) {
    const TimestampPair pair = pair_at(reference_ns, free_ns);
    return update_in_order(order_, *servo_, pair, {pair.free_running, pair.local});
  }
  MessageOrder order_;
  std::unique_ptr<AnyServo> servo_;
};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryServo,
                         ::testing::Values(ServoKind::kFtcs, ServoKind::kPics,
                                           ServoKind::kLinuxptpPi, ServoKind::kFreeRunning,
                                           ServoKind::kAdaptive, ServoKind::kRegression,
                                           ServoKind::kPid, ServoKind::kFrequencyCompensated,
                                           ServoKind::kKalman, ServoKind::kMinimumDelay));

TEST_P(EveryServo, refuses_what_is_no_news_in_the_same_words_and_without_a_command) {
  for (int n = 1; n <= 10; ++n) (void)feed(n * kSecond, n * kSecond);
  const auto expect_refused = [this](std::int64_t reference, std::int64_t free, SampleVerdict why) {
    const ServoUpdate update = feed(reference, free);
    EXPECT_EQ(update.verdict, why);
    EXPECT_FALSE(update.has_command);
  };
  expect_refused(10 * kSecond, 10 * kSecond, SampleVerdict::kDuplicate);
  expect_refused(9 * kSecond, 9 * kSecond, SampleVerdict::kDuplicate);
  expect_refused(9 * kSecond, 11 * kSecond, SampleVerdict::kImplausible);
  EXPECT_EQ(feed(12 * kSecond, 12 * kSecond).verdict, SampleVerdict::kUsed);
}

/// Whatever it measured: three messages in order are the truth, even if a clock was set back.
TEST_P(EveryServo, follows_a_reference_that_was_set_back) {
  for (int n = 1; n <= 10; ++n) (void)feed(n * kSecond, n * kSecond);
  for (int n = 11; n <= 30; ++n) (void)feed((n - 5) * kSecond, n * kSecond);
  EXPECT_NEAR(servo_->snapshot().offset.seconds(), 5.0, 1e-3);
  EXPECT_EQ(feed(26 * kSecond, 31 * kSecond).verdict, SampleVerdict::kUsed);
}

/// A host whose counters began anew, with the reference's: two-way servos refused it for ever.
TEST_P(EveryServo, follows_when_both_clocks_were_set_back) {
  for (int n = 101; n <= 110; ++n) (void)feed(n * kSecond, n * kSecond);
  for (int n = 1; n <= 3; ++n) (void)feed(n * kSecond, n * kSecond);
  for (int n = 4; n <= 10; ++n) {
    EXPECT_EQ(feed(n * kSecond, n * kSecond).verdict, SampleVerdict::kUsed) << n;
  }
}

}  // namespace
}  // namespace ftcs
