// SPDX-License-Identifier: MIT
// The world: a status socket in a folder of its own, asked as `ftcs status` asks.
#include "ftcs/fieldbus/run_status.h"

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/management_server.h"
#include "ftcs/daemon/status_report.h"

namespace ftcs::daemon {
namespace {

class RunStatusTest : public ::testing::Test {
 protected:
  RunStatusTest() {
    std::string pattern = std::filesystem::temp_directory_path() / "ftcs-status-XXXXXX";
    folder_ = ::mkdtemp(pattern.data());
    options_.status_socket = folder_ + "/s";
    options_.plant_time = "ptp:eth1";
    options_.bus_mode = node::BusMode::kExternal;
    snapshot_.state = CycleState::kLocked;
    snapshot_.all_operational = true;
    snapshot_.drives = 2;
    snapshot_.clocks[1].last = 17;
    snapshot_.bus.known = true;
    snapshot_.bus.state = BusClockState::kLocked;
    snapshot_.bus.dc_to_plant = Duration::from_ns(-25.0);
    snapshot_.bus.sigma_ns = 31.0;
    snapshot_.bus.rate_ppb = -29'952.0;
    snapshot_.seen.state = CycleState::kLocked;
    snapshot_.seen.cycles = 1000;
    snapshot_.seen.margin_ns = 5e5;
    snapshot_.seen.cycle_ns = 1e6;
  }
  ~RunStatusTest() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string ask() const {
    auto client = platform::LocalSocket::client();
    const std::string_view query = kStatusQuery;
    EXPECT_FALSE(client->send(options_.status_socket,
                              {reinterpret_cast<const std::uint8_t*>(query.data()), query.size()}));
    client->wait(2000);
    const auto answer = client->receive();
    return answer ? std::string(answer->bytes.begin(), answer->bytes.end()) : "";
  }

  std::string folder_;
  RunOptions options_;
  RunSnapshot snapshot_;
};

TEST_F(RunStatusTest, tells_who_asks_of_plant_time_and_of_the_drives) {
  auto status = RunStatus::open(options_);
  ASSERT_TRUE(status) << status.error().message();
  (*status)->publish(snapshot_);
  const auto read = read_status(ask());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->exit_code, kSuccess);
  EXPECT_NE(read->text.find("ptp:eth1, external, locked; dc to plant -0.025 us (sigma 0.031 us), "
                            "bent by -29.952 ppm"),
            std::string::npos)
      << read->text;
  EXPECT_NE(read->text.find("2 drives, all in OP"), std::string::npos) << read->text;
  EXPECT_NE(read->text.find("|0x092C| 17 ns at most"), std::string::npos) << read->text;
}

// The clocks are asked in turn, one in each cycle.
TEST_F(RunStatusTest, a_clock_that_nobody_has_looked_at_is_not_said_to_be_right) {
  const std::string json = run_status(options_, snapshot_);
  const auto one = read_status(json);
  EXPECT_NE(json.find("\"system_time_difference_ns\": null"), std::string::npos) << json;
  EXPECT_NE(one->text.find("|0x092C| 17 ns at most"), std::string::npos) << one->text;
  snapshot_.clocks[1].last.reset();
  const auto none = read_status(run_status(options_, snapshot_));
  EXPECT_NE(none->text.find("|0x092C| not judged"), std::string::npos) << none->text;
}

TEST_F(RunStatusTest, is_not_locked_before_the_cycle_is) {
  snapshot_.state = snapshot_.seen.state = CycleState::kAcquiring;
  snapshot_.bus = {};
  const auto read = read_status(run_status(options_, snapshot_));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->exit_code, kNotLocked);
}

// The sentence says "in phase, but": the code must not say "locked".
TEST_F(RunStatusTest, is_not_locked_while_something_speaks_against_the_cycle) {
  snapshot_.seen.late = snapshot_.seen.cycles;
  const auto read = read_status(run_status(options_, snapshot_));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->exit_code, kNotLocked);
}

TEST_F(RunStatusTest, without_plant_time_says_nothing_of_it) {
  options_.plant_time.clear();
  const auto read = read_status(run_status(options_, snapshot_));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->text.find("plant time"), std::string::npos) << read->text;
}

TEST_F(RunStatusTest, a_second_run_cannot_have_the_same_socket) {
  auto first = RunStatus::open(options_);
  ASSERT_TRUE(first);
  EXPECT_FALSE(RunStatus::open(options_));
}

}  // namespace
}  // namespace ftcs::daemon
