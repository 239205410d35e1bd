// SPDX-License-Identifier: MIT
#include "ftcs/time/instant.h"

#include <concepts>

#include <gtest/gtest.h>

#include "ftcs/time/timestamp_pair.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;

template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept Comparable = requires(A a, B b) {
  a < b;
};

TEST(Instant, timescales_do_not_mix) {
  static_assert(Subtractable<LocalTime, LocalTime>);
  static_assert(!Subtractable<LocalTime, ReferenceTime>);
  static_assert(!Subtractable<FreeRunningTime, LocalTime>);
  static_assert(!Comparable<LocalTime, ReferenceTime>);
  static_assert(!std::convertible_to<LocalTime, ReferenceTime>);
}

TEST(Instant, offset_is_positive_when_the_local_clock_is_ahead) {
  EXPECT_EQ(offset_from_reference(LocalTime::from_ns(1'100), ReferenceTime::from_ns(1'000)),
            Duration{100ns});
  EXPECT_EQ(offset_from_reference(LocalTime::from_ns(900), ReferenceTime::from_ns(1'000)),
            Duration{-100ns});
}

TEST(SyncSample, path_delay_is_added_to_the_origin) {
  const SyncSample sample{.origin = ReferenceTime::from_ns(1'000),
                          .path_delay = 30ns,
                          .local = LocalTime::from_ns(1'042),
                          .free_running = {}};
  EXPECT_EQ(sample.reference(), ReferenceTime::from_ns(1'030));
  EXPECT_EQ(sample.offset(), Duration{12ns});
}

}  // namespace
}  // namespace ftcs
