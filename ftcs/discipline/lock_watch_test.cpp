// SPDX-License-Identifier: MIT
#include "ftcs/discipline/lock_watch.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

void run(LockWatch& watch, bool locked, int cycles) {
  for (int i = 0; i < cycles; ++i) watch.update(locked);
}

TEST(LockWatch, says_each_change_once) {
  LockWatch watch;
  EXPECT_EQ(watch.update(false), LockWatch::Change::kNone);
  EXPECT_EQ(watch.update(true), LockWatch::Change::kLocked);
  EXPECT_EQ(watch.update(true), LockWatch::Change::kNone);
  EXPECT_EQ(watch.update(false), LockWatch::Change::kLost);
  EXPECT_EQ(watch.losses(), 1U);
}

TEST(LockWatch, before_the_first_lock_nothing_was_lost) {
  LockWatch watch;
  run(watch, false, 100);
  EXPECT_EQ(watch.without(), 0U);
  EXPECT_EQ(watch.losses(), 0U);
}

TEST(LockWatch, counts_the_cycles_of_this_loss_and_not_from_an_earlier_one) {
  LockWatch watch;
  run(watch, true, 10);
  run(watch, false, 28);
  EXPECT_EQ(watch.without(), 28U);
  run(watch, true, 30'000);
  EXPECT_EQ(watch.without(), 0U);
  EXPECT_EQ(watch.longest_relock(), 28U);
  run(watch, false, 1);
  EXPECT_EQ(watch.without(), 1U);
  run(watch, true, 1);
  EXPECT_EQ(watch.longest_relock(), 28U);
  EXPECT_EQ(watch.losses(), 2U);
}

}  // namespace
}  // namespace ftcs
