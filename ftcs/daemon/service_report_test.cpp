// SPDX-License-Identifier: MIT
//
// The world: a socket of this process in systemd's place.
#include "ftcs/daemon/service_report.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/platform/local_socket.h"

namespace ftcs::daemon {
namespace {

class Report : public testing::Test {
 protected:
  void turn(std::int64_t ms, bool locked) {
    report.turn(FreeRunningTime::from_ns(ms * 1'000'000), locked, [&] {
      ++asked;
      return (locked ? "locked, turn " : "not locked, turn ") + std::to_string(ms);
    });
  }
  std::vector<std::string> heard() {
    std::vector<std::string> result;
    while (const auto datagram = manager->receive()) {
      result.emplace_back(datagram->bytes.begin(), datagram->bytes.end());
    }
    return result;
  }
  using Lines = std::vector<std::string>;
  Result<platform::LocalSocket, platform::OsError> manager = platform::LocalSocket::client();
  ServiceReport report{platform::ServiceManager{manager->path(), 40'000'000}};
  int asked = 0;
};

TEST_F(Report, the_service_is_ready_at_the_first_lock_and_not_before) {
  turn(0, false);
  EXPECT_EQ(heard(), (Lines{"WATCHDOG=1", "STATUS=not locked, turn 0"}));
  turn(500, true);
  EXPECT_EQ(heard(), (Lines{"STATUS=locked, turn 500", "READY=1"}));
  turn(600, false);
  turn(700, true);
  EXPECT_EQ(heard(), (Lines{"STATUS=not locked, turn 600", "STATUS=locked, turn 700"}));
}

TEST_F(Report, a_sentence_is_made_once_a_second) {
  for (std::int64_t ms = 0; ms < 3000; ms += 10) turn(ms, false);
  EXPECT_EQ(asked, 3);
}

TEST_F(Report, a_loop_that_turns_is_alive) {
  std::size_t signs = 0;
  for (std::int64_t ms = 0; ms < 30'000; ms += 500) {
    turn(ms, false);
    for (const std::string& line : heard()) signs += line == "WATCHDOG=1" ? 1U : 0U;
  }
  EXPECT_EQ(signs, 3U) << "each ten of forty seconds";
}

}  // namespace
}  // namespace ftcs::daemon
