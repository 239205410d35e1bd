// SPDX-License-Identifier: MIT
#include "ftcs/platform/interrupt.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

TEST(Interrupt, the_same_signal_twice_at_once_asks_once) {
  const Interrupt interrupt;
  EXPECT_FALSE(interrupt.flag());
  std::raise(SIGINT);
  std::raise(SIGINT);  // kills, where the first one had taken the handler away
  EXPECT_TRUE(interrupt.flag());
}

TEST(InterruptDeathTest, a_second_one_half_a_second_later_kills) {
  const auto twice = [] {
    const Interrupt interrupt;
    std::raise(SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    std::raise(SIGINT);
  };
  EXPECT_EXIT(twice(), testing::KilledBySignal(SIGINT), "");
}

TEST(Interrupt, begins_anew_each_time) {
  {
    const Interrupt interrupt;
    std::raise(SIGINT);
  }
  const Interrupt interrupt;
  EXPECT_FALSE(interrupt.flag());
  std::raise(SIGTERM);
  EXPECT_TRUE(interrupt.flag());
}

}  // namespace
}  // namespace ftcs::platform
