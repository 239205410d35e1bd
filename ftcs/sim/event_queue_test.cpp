// SPDX-License-Identifier: MIT
// World: events carry an integer; times in nanoseconds.
#include "ftcs/sim/event_queue.h"

#include <vector>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

TEST(EventQueue, gives_events_in_order_of_time) {
  EventQueue<int> queue;
  for (const int t : {5, 1, 4, 2, 3}) queue.schedule(TrueTime::from_ns(t), t);
  for (int expected = 1; expected <= 5; ++expected) EXPECT_EQ(queue.pop().event, expected);
  EXPECT_TRUE(queue.empty());
}

TEST(EventQueue, keeps_the_order_of_entry_at_one_instant) {
  EventQueue<int> queue;
  for (int i = 0; i < 1000; ++i) queue.schedule(TrueTime::from_ns(i % 3), i);
  int last_at[3] = {-1, -1, -1};
  while (!queue.empty()) {
    const int event = queue.pop().event;
    EXPECT_GT(event, last_at[event % 3]);
    last_at[event % 3] = event;
  }
}

TEST(EventQueue, tells_apart_instants_that_differ_by_a_fraction_of_a_nanosecond) {
  EventQueue<int> queue;
  queue.schedule(TrueTime{Duration::from_parts(7, 2)}, 2);
  queue.schedule(TrueTime{Duration::from_parts(7, 1)}, 1);
  EXPECT_EQ(queue.pop().event, 1);
}

}  // namespace
}  // namespace ftcs::sim
