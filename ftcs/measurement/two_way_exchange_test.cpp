// SPDX-License-Identifier: MIT
#include "ftcs/measurement/two_way_exchange.h"

#include <cstdint>
#include <random>

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

// The world: t2 = t1 + d_forward + theta, t3 = t2 + w, t4 = t3 - theta + d_backward; theta = local
// - reference.
TwoWayExchange exchange(Duration theta, Duration forward, Duration backward, Duration turnaround) {
  const auto t1 = ReferenceTime{Duration{1000s}};
  const auto t2 = LocalTime{t1.since_epoch() + forward + theta};
  const auto t3 = t2 + turnaround;
  return {t1, t2, t3, ReferenceTime{t3.since_epoch() - theta + backward}};
}

TEST(TwoWayExchange, separates_offset_and_delay) {
  const auto path =
      estimate_path(exchange(Duration{-700ns}, Duration{30us}, Duration{30us}, Duration{2ms}));
  EXPECT_EQ(path.offset, Duration{-700ns});
  EXPECT_EQ(path.mean_path_delay, Duration{30us});
}

TEST(TwoWayExchange, offset_is_positive_when_the_local_clock_is_ahead) {
  EXPECT_EQ(estimate_path(exchange(Duration{1s}, Duration{5us}, Duration{5us}, Duration{})).offset,
            Duration{1s});
}

TEST(TwoWayExchange, turnaround_is_no_delay) {
  // Paper eq. (2) as printed gives d + w.
  for (const Duration turnaround : {Duration{}, Duration{1ms}, Duration{1s}}) {
    const auto path =
        estimate_path(exchange(Duration{3us}, Duration{20us}, Duration{20us}, turnaround));
    EXPECT_EQ(path.mean_path_delay, Duration{20us});
    EXPECT_EQ(path.offset, Duration{3us});
  }
}

TEST(TwoWayExchange, asymmetry_is_positive_when_the_way_to_the_receiver_is_slower) {
  // IEEE 1588-2019, 7.4.2: t_ms = mean + asymmetry, t_sm = mean - asymmetry.
  const auto slow_forward =
      exchange(Duration{100ns}, Duration{30us}, Duration{20us}, Duration{1ms});
  EXPECT_EQ(estimate_path(slow_forward, Duration{5us}).offset, Duration{100ns});
  EXPECT_EQ(estimate_path(slow_forward, Duration{5us}).mean_path_delay, Duration{25us});
  EXPECT_EQ(estimate_path(slow_forward).offset, Duration{100ns} + Duration{5us});
  EXPECT_EQ(forward_delay(Duration{25us}, Duration{5us}), Duration{30us});
}

TEST(TwoWayExchange, rate_compensation_removes_what_the_skew_adds_to_the_turnaround) {
  // The local clock is 50 ppm fast: 100 ms of turn-around are 100.005 ms on it.
  auto stamps = exchange(Duration{}, Duration{10us}, Duration{10us}, Duration{100ms});
  stamps.t3 = stamps.t3 + Duration{5us};
  EXPECT_EQ(estimate_path(stamps).mean_path_delay, Duration{10us} - Duration{2500ns});
  const auto compensated = estimate_path(stamps, Duration{}, Rate::from_ppm(50.0).inverse());
  EXPECT_NEAR(compensated.mean_path_delay.ns(), 10'000.0, 1e-6);
  EXPECT_NEAR(compensated.offset.ns(), 0.0, 1e-6);
}

TEST(TwoWayExchange, agrees_with_the_textbook_on_random_stamps) {
  // Corrected eq. (1): reference - local = ((t1 - t2) - (t3 - t4)) / 2; eq. (2): ((t4 - t1) - (t3 -
  // t2)) / 2.
  std::mt19937_64 random(1);
  for (int i = 0; i < 10'000; ++i) {
    std::int64_t stamp[4] = {};
    for (std::int64_t& ns : stamp) ns = static_cast<std::int64_t>(random() >> 4);
    const TwoWayExchange stamps{ReferenceTime::from_ns(stamp[0]), LocalTime::from_ns(stamp[1]),
                                LocalTime::from_ns(stamp[2]), ReferenceTime::from_ns(stamp[3])};
    const auto path = estimate_path(stamps);
    const std::int64_t twice_offset = (stamp[1] - stamp[0]) - (stamp[3] - stamp[2]);
    const std::int64_t twice_delay = (stamp[3] - stamp[0]) - (stamp[2] - stamp[1]);
    ASSERT_EQ(path.offset + path.offset, Duration::from_whole_ns(twice_offset));
    ASSERT_EQ(path.mean_path_delay + path.mean_path_delay, Duration::from_whole_ns(twice_delay));
  }
}

}  // namespace
}  // namespace ftcs
