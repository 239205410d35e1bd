// SPDX-License-Identifier: MIT
//
// The world: a socket of this process in systemd's place.
#include "ftcs/platform/service_manager.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/platform/local_socket.h"

namespace ftcs::platform {
namespace {

class Service : public testing::Test {
 protected:
  std::vector<std::string> heard() {
    std::vector<std::string> result;
    while (const auto datagram = manager->receive()) {
      result.emplace_back(datagram->bytes.begin(), datagram->bytes.end());
    }
    return result;
  }
  Result<LocalSocket, OsError> manager = LocalSocket::client();
  using Lines = std::vector<std::string>;
};

TEST_F(Service, ready_is_told_once) {
  ServiceManager service{manager->path()};
  service.ready();
  service.ready();
  EXPECT_EQ(heard(), Lines{"READY=1"});
  EXPECT_FALSE(service.error());
}

TEST_F(Service, ready_is_told_again_if_the_queue_was_full) {
  ServiceManager service{manager->path()};
  for (int i = 0; i < 1000 && !service.error(); ++i) service.stopping();
  ASSERT_TRUE(service.error()) << "the kernel takes a limited number";
  service.ready();
  for (const std::string& line : heard()) EXPECT_EQ(line, "STOPPING=1");
  service.ready();
  EXPECT_EQ(heard(), Lines{"READY=1"});
}

TEST_F(Service, a_sentence_is_told_when_it_changes_and_is_one_line) {
  ServiceManager service{manager->path()};
  service.status("waiting for an Announce");
  service.status("waiting for an Announce");
  service.status("locked\nREADY=1");
  EXPECT_EQ(heard(), (Lines{"STATUS=waiting for an Announce", "STATUS=locked READY=1"}));
}

TEST_F(Service, signs_of_life_come_four_times_a_period_and_only_if_asked_for) {
  ServiceManager service{manager->path(), 4'000'000};
  for (std::int64_t ms = 0; ms < 4000; ms += 10) service.alive(ms * 1'000'000);
  EXPECT_EQ(heard(), Lines(4, "WATCHDOG=1"));
  ServiceManager unwatched{manager->path()};
  unwatched.alive(1);
  EXPECT_TRUE(heard().empty());
}

TEST_F(Service, without_a_manager_nothing_happens) {
  ServiceManager service{""};
  service.ready();
  service.status("locked");
  service.alive(1);
  service.stopping();
  EXPECT_FALSE(service.error());
}

TEST_F(Service, a_manager_that_is_gone_is_an_error_that_can_be_asked_for) {
  ServiceManager service{manager->path() + ".gone"};
  service.ready();
  ASSERT_TRUE(service.error());
}

TEST_F(Service, the_environment_names_the_socket_and_whose_watchdog_it_is) {
  setenv("NOTIFY_SOCKET", manager->path().c_str(), 1);
  setenv("WATCHDOG_USEC", "1000000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  ServiceManager service = ServiceManager::from_environment();
  service.alive(1);
  EXPECT_TRUE(heard().empty());
  service.stopping();
  EXPECT_EQ(heard(), Lines{"STOPPING=1"});
  for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
}

}  // namespace
}  // namespace ftcs::platform
