// SPDX-License-Identifier: MIT
#include "ftcs/estimation/interval_meter.h"

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

constexpr double kSecond = 1e9;

class Messages {
 public:
  explicit Messages(double configured_ns = 0.0) : meter_(configured_ns) {}

  double at(Direction direction, double seconds) {
    TimestampPair pair;
    pair.direction = direction;
    pair.reference = ReferenceTime{Duration::from_ns(seconds * kSecond)};
    return meter_.observe(pair);
  }
  double forward(double seconds) { return at(Direction::kForward, seconds); }
  double backward(double seconds) { return at(Direction::kBackward, seconds); }
  [[nodiscard]] const IntervalMeter& meter() const { return meter_; }

 private:
  IntervalMeter meter_;
};

TEST(IntervalMeter, takes_the_first_interval_of_forward_messages) {
  Messages messages;
  messages.forward(0.0);
  EXPECT_DOUBLE_EQ(messages.forward(0.125), 0.125);
  EXPECT_DOUBLE_EQ(messages.meter().interval_ns(), 0.125 * kSecond);
}

TEST(IntervalMeter, does_not_take_a_burst_of_requests_for_a_faster_schedule) {
  // Delay_Req leave at random within two intervals; five of them happened to
  // leave in a row.
  Messages messages;
  for (int i = 0; i < 4; ++i) messages.forward(i);
  for (const double t : {3.2, 3.21, 3.25, 3.26, 3.27, 3.272}) {
    EXPECT_DOUBLE_EQ(messages.backward(t), 1.0) << t;
  }
  messages.forward(4.0);
  for (const double t : {4.2, 4.21, 4.25, 4.26}) EXPECT_DOUBLE_EQ(messages.backward(t), 1.0) << t;
  EXPECT_DOUBLE_EQ(messages.meter().interval_ns(), kSecond);
}

TEST(IntervalMeter, follows_a_new_schedule_after_four_forward_messages) {
  Messages messages;
  for (int i = 0; i < 4; ++i) messages.forward(i);
  for (int i = 1; i < 4; ++i) EXPECT_DOUBLE_EQ(messages.forward(3.0 + 0.125 * i), 1.0) << i;
  EXPECT_DOUBLE_EQ(messages.forward(3.5), 0.125);
}

TEST(IntervalMeter, follows_it_although_requests_keep_theirs) {
  Messages messages;
  for (int i = 0; i < 4; ++i) {
    messages.forward(i);
    messages.backward(i + 0.05);
  }
  for (int i = 1; i < 4; ++i) {
    messages.forward(3.0 + 0.25 * i);
    messages.backward(3.05 + i);  // fits the old interval
  }
  EXPECT_DOUBLE_EQ(messages.forward(4.0), 0.25);
}

TEST(IntervalMeter, serves_one_direction_of_requests_alone) {
  Messages messages;
  messages.backward(0.0);
  messages.backward(0.01);
  EXPECT_DOUBLE_EQ(messages.backward(0.02), 0.01);
}

TEST(IntervalMeter, says_when_messages_are_far_enough_apart_to_tell_a_rate) {
  Messages messages(kSecond);
  messages.forward(0.0);
  messages.backward(0.3);
  messages.backward(0.31);
  EXPECT_FALSE(messages.meter().tells_rate());
  messages.backward(0.5);
  EXPECT_TRUE(messages.meter().tells_rate());
}

}  // namespace
}  // namespace ftcs::estimation
