// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/watch_feed.h"

#include <atomic>
#include <cmath>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "ftcs/daemon/watch/watch_history.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::daemon {
namespace {

TEST(TripleBuffer, a_reader_sees_whole_values_and_never_an_older_one) {
  struct Pair {
    std::uint64_t first = 0;
    std::uint64_t second = 0;
  };
  TripleBuffer<Pair> buffer;
  constexpr std::uint64_t kLast = 200'000;
  std::thread writer([&buffer] {
    for (std::uint64_t i = 1; i <= kLast; ++i) buffer.write({i, i});
  });
  std::uint64_t before = 0;
  while (before < kLast) {
    const Pair seen = buffer.read();
    ASSERT_EQ(seen.first, seen.second);
    ASSERT_GE(seen.first, before);
    before = seen.first;
  }
  writer.join();
}

TEST(PointQueue, what_does_not_fit_is_dropped_and_counted_and_the_rest_is_in_order) {
  PointQueue<int, 4> queue;
  for (int i = 0; i < 6; ++i) queue.push(i);
  EXPECT_EQ(queue.dropped(), 2U);
  int value = -1;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(queue.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_FALSE(queue.pop(value));
  queue.push(9);
  EXPECT_TRUE(queue.pop(value));
  EXPECT_EQ(value, 9);
}

TEST(WatchFeed, a_loop_at_real_time_priority_may_use_it) {
  const auto feed = std::make_unique<WatchFeed>();
  WatchState state;
  {
    const test::ForbidAllocation none;
    for (int i = 0; i < 20'000; ++i) feed->add({});  // nobody reads: no harm
    state.sentence.set("locked: phase 3 us");
    feed->publish(state);
  }
  EXPECT_EQ(feed->state().sentence.view(), "locked: phase 3 us");
}

WatchPoint point(double time_s, double offset_ns) {
  WatchPoint one;
  one.time_s = time_s;
  one.offset_ns = offset_ns;
  return one;
}

TEST(WatchHistory, white_noise_of_the_phase_has_its_deviation_however_long_it_runs) {
  WatchHistory history;
  std::uint64_t state = 1;
  for (int i = 0; i < 200'000; ++i) {  // uniform, +-100 ns
    state = state * 6364136223846793005U + 1442695040888963407U;
    history.add(point(0.125 * i, static_cast<double>(state >> 40) / 83886.08 - 100.0));
  }
  const auto tdev = history.deviations(Deviation::kTime);
  ASSERT_GT(tdev.size(), 6U);
  EXPECT_NEAR(tdev.front().deviation, 57.7e-9, 3e-9);  // 200 / sqrt(12) ns
  EXPECT_NEAR(tdev.front().tau_s, 0.125 * 32.0, 0.05) << "every 32nd was kept";
  EXPECT_GT(tdev.back().tau_s, 4000.0) << "and the whole run is in view";
  EXPECT_LE(history.recent().size(), 2048U);
  const WatchHistogram histogram = history.histogram();
  EXPECT_EQ(histogram.counts.size(), 41U);
  EXPECT_NEAR(histogram.lowest_ns, -98.0, 2.0);
  EXPECT_NEAR(history.largest_ns().value_or(0.0), 100.0, 1.0);
}

TEST(WatchHistory, what_was_refused_or_not_locked_is_no_figure) {
  WatchHistory history;
  for (int i = 0; i < 100; ++i) {
    WatchPoint one = point(i, i % 2 == 0 ? 1e9 : 10.0);
    one.used = i % 2 != 0;
    one.locked = i > 50;
    history.add(one);
  }
  EXPECT_EQ(history.largest_ns(), 10.0);
  const auto adev = history.deviations(Deviation::kOverlappingAllan);
  ASSERT_FALSE(adev.empty());
  EXPECT_EQ(adev.front().deviation, 0.0);
  EXPECT_TRUE(WatchHistory{}.deviations(Deviation::kTime).empty());
  EXPECT_TRUE(WatchHistory{}.histogram().counts.empty());
}

}  // namespace
}  // namespace ftcs::daemon
