// SPDX-License-Identifier: MIT
#include "ftcs/platform/child_process.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "ftcs/platform/stop_flag.h"

namespace ftcs::platform {
namespace {
using namespace std::chrono_literals;

TEST(ChildProcess, hands_on_the_exit_code_of_its_body) {
  auto child = ChildProcess::start([] { return 7; });
  ASSERT_TRUE(child.ok());
  while (!child->ended()) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(child->ended(), 7);
  EXPECT_EQ(child->stop(), 7);
}

TEST(ChildProcess, stops_a_body_that_would_run_for_ever) {
  auto child = ChildProcess::start([] {
    const StopFlag stop;
    while (!stop.is_set()) std::this_thread::sleep_for(1ms);
    return 5;
  });
  ASSERT_TRUE(child.ok());
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(child->ended(), std::nullopt);
  EXPECT_EQ(child->stop(), 5);
}

TEST(ChildProcess, reports_the_signal_that_ended_it) {
  auto child = ChildProcess::start([]() -> int { std::abort(); });
  ASSERT_TRUE(child.ok());
  while (!child->ended()) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(child->ended(), 128 + 6);
}

}  // namespace
}  // namespace ftcs::platform
