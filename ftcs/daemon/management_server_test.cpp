// SPDX-License-Identifier: MIT
// World: a port behind a management socket in a temporary folder, and who asks it: a client of this
// program, and Debian's phc2sys without the right to set a clock.
#include "ftcs/daemon/management_server.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

#include "ftcs/platform/child_process.h"

namespace ftcs::daemon {
namespace {

using namespace std::chrono_literals;
using platform::LocalSocket;
using ptp::ManagementId;
using ptp::PortState;

FreeRunningTime at(Nanoseconds time) { return FreeRunningTime{Duration{time}}; }

/// A port with software stamps: phc2sys has nothing to steer by it.
struct FakePort final : Managed {
  ptp::ManagedPort managed_port() override {
    ptp::ManagedPort port;
    port.identity = port.port.port =
        port.properties.port = {ptp::ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
    port.default_set.identity = port.identity.clock;
    port.port.state = port.properties.state = state;
    port.properties.interface = ptp::PtpText<32>("lo");
    return port;
  }
  std::string status(const ptp::ManagementCounters&) override { return "{}"; }
  PortState state = PortState::kUncalibrated;
};

class ManagementServerTest : public testing::Test {
 protected:
  ManagementServerTest() {
    EXPECT_NE(mkdtemp(folder.data()), nullptr);
    auto opened = ManagementServer::open(folder + "/server");
    EXPECT_TRUE(opened.ok());
    server.emplace(std::move(*opened));
  }
  ~ManagementServerTest() override {
    server.reset();
    std::filesystem::remove_all(folder);
  }
  /// What a client gets for a question, or for none.
  std::optional<ptp::ManagementMessage> exchange(LocalSocket& client, Nanoseconds now,
                                                 const ptp::ManagementMessage* question) {
    if (question != nullptr) {
      EXPECT_FALSE(client.send(server->path(), ptp::encode_management(*question).view()));
    }
    server->serve(port, at(now));
    const auto datagram = client.receive();
    if (!datagram) return std::nullopt;
    const auto message = ptp::decode_management(datagram->bytes);
    EXPECT_TRUE(message.ok());
    return *message;
  }
  static ptp::ManagementMessage subscription(std::uint16_t duration_s, bool all = true) {
    ptp::ManagementMessage message;
    message.body.target = {ptp::ClockIdentity{{255, 255, 255, 255, 255, 255, 255, 255}}, 0xFFFF};
    message.body.action = static_cast<std::uint8_t>(ptp::ManagementAction::kSet);
    message.id = ManagementId::kSubscribeEventsNp;
    ptp::SubscribeEventsNp wanted;
    wanted.duration_s = duration_s;
    if (all) wanted.events.fill(0xFF);
    message.data = wanted;
    return message;
  }

  std::string folder = (std::filesystem::temp_directory_path() / "ftcs-management-XXXXXX").string();
  std::optional<ManagementServer> server;
  FakePort port;
};

TEST_F(ManagementServerTest, a_subscriber_is_told_of_each_new_state_until_its_time_is_over) {
  auto client = LocalSocket::client();
  ASSERT_TRUE(client.ok());
  const auto asked = subscription(60);
  EXPECT_TRUE(exchange(*client, 0s, &asked).has_value());
  EXPECT_FALSE(exchange(*client, 1s, nullptr).has_value()) << "nothing has changed";
  std::uint16_t sequence_id = 0;
  for (const auto state : {PortState::kTimeReceiver, PortState::kListening}) {
    port.state = state;
    const auto notice = exchange(*client, 2s, nullptr);
    ASSERT_TRUE(notice.has_value());
    EXPECT_EQ(std::get<ptp::PortDataSet>(*notice->data).state, state);
    EXPECT_EQ(notice->header.sequence_id, sequence_id++);
    EXPECT_FALSE(exchange(*client, 3s, nullptr).has_value()) << "once";
  }
  const auto again = subscription(60);
  EXPECT_TRUE(exchange(*client, 50s, &again).has_value()) << "prolonged";
  port.state = PortState::kTimeReceiver;
  EXPECT_TRUE(exchange(*client, 100s, nullptr).has_value());
  port.state = PortState::kListening;
  EXPECT_FALSE(exchange(*client, 111s, nullptr).has_value()) << "over";
}

TEST_F(ManagementServerTest, who_asks_sees_the_own_subscription_and_can_end_it) {
  auto client = LocalSocket::client();
  auto other = LocalSocket::client();
  ASSERT_TRUE(client.ok() && other.ok());
  const auto asked = subscription(60);
  (void)exchange(*client, 0s, &asked);
  auto question = asked;
  question.data.reset();
  question.body.action = static_cast<std::uint8_t>(ptp::ManagementAction::kGet);
  const auto mine = exchange(*client, 1s, &question);
  const auto theirs = exchange(*other, 1s, &question);
  ASSERT_TRUE(mine && theirs);
  EXPECT_EQ(std::get<ptp::SubscribeEventsNp>(*mine->data).duration_s, 60);
  EXPECT_EQ(std::get<ptp::SubscribeEventsNp>(*theirs->data).duration_s, 0);
  const auto none = subscription(60, false);
  (void)exchange(*client, 2s, &none);
  port.state = PortState::kTimeReceiver;
  EXPECT_FALSE(exchange(*client, 3s, nullptr).has_value());
}

TEST_F(ManagementServerTest, crowds_and_those_who_have_gone_do_no_harm) {
  std::vector<LocalSocket> clients;
  const auto asked = subscription(60);
  for (int i = 0; i < 20; ++i) {
    auto client = LocalSocket::client();
    ASSERT_TRUE(client.ok());
    clients.push_back(std::move(*client));
    EXPECT_TRUE(exchange(clients.back(), 0s, &asked).has_value()) << "each is answered";
  }
  clients.erase(clients.begin());
  port.state = PortState::kTimeReceiver;
  server->serve(port, at(1s));
  EXPECT_TRUE(clients[0].receive().has_value());
}

// It subscribes first of all, and gives up where that fails; then it asks for the ports, and gives
// up where none has a hardware clock, as this one.
TEST_F(ManagementServerTest, phc2sys_of_linuxptp_can_subscribe_and_reads_the_port) {
  const std::string program = "/usr/sbin/phc2sys";
  if (::access(program.c_str(), X_OK) != 0) GTEST_SKIP() << "no phc2sys";
  if (::access("/usr/bin/setpriv", X_OK) != 0) GTEST_SKIP() << "no setpriv";
  if (::geteuid() != 0) GTEST_SKIP() << "phc2sys has its socket in /var/run";
  const std::string log = folder + "/log";
  auto phc2sys = platform::ChildProcess::start([&] {
    if (std::freopen(log.c_str(), "w", stdout) == nullptr || ::dup2(1, 2) < 0) return 1;
    // It may not set a clock, whatever it thinks.
    return ::execl("/usr/bin/setpriv", "setpriv", "--bounding-set", "-sys_time", "--inh-caps",
                   "-sys_time", program.c_str(), "-a", "-r", "-m", "-q", "-z",
                   server->path().c_str(), nullptr);
  });
  ASSERT_TRUE(phc2sys.ok());
  for (int i = 0; i < 500 && !phc2sys->ended().has_value(); ++i) {
    server->serve(port, at(i * 20ms));
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_TRUE(phc2sys->ended().has_value());
  std::stringstream said;
  said << std::ifstream(log).rdbuf();
  EXPECT_EQ(said.str().find("failed to subscribe"), std::string::npos) << said.str();
  EXPECT_NE(said.str().find("no suitable ports available"), std::string::npos) << said.str();
}

}  // namespace
}  // namespace ftcs::daemon
