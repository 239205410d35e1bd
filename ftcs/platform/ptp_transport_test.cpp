// SPDX-License-Identifier: MIT
// World: the interface "eth0" of a fake kernel goes away, comes back, loses its carrier or is
// replaced.
#include "ftcs/platform/ptp_transport.h"

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::platform {
namespace {

struct Recorder final : TransportHandler {
  std::vector<std::string> events;
  void on_message(const ReceivedMessage& message) override {
    events.push_back("message " + std::to_string(message.bytes.size()));
  }
  void on_transmitted(const TransmittedMessage& message) override {
    events.emplace_back(message.stamp ? "stamp" : "no stamp");
  }
  void on_readable(int descriptor) override {
    events.push_back("readable " + std::to_string(descriptor));
  }
  void on_link(bool up, const std::string& reason) override {
    events.push_back(up ? "up" : "down: " + reason);
  }
};

struct Bench {
  FakeKernel kernel;
  Recorder recorder;
  std::unique_ptr<TimestampClock> clock =
      std::move(*TimestampClock::open(kernel, "eth0", TimestampMode::kBestAvailable));
  PtpTransport transport{kernel, config(), *clock, recorder};

  static PtpSocketConfig config() {
    PtpSocketConfig config;
    config.interface = "eth0";
    return config;
  }
  void run_for(std::chrono::seconds time) {
    const FreeRunningTime end = clock->source().now() + Duration{time};
    while (clock->source().now() < end) transport.wait_until(end);
  }
};

using std::chrono::seconds;
using Events = std::vector<std::string>;

TEST(PtpTransport, wakes_for_a_watched_descriptor) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  constexpr int kWatched = 77;
  bench.kernel.sockets[kWatched].received.push_back({std::vector<std::uint8_t>(8), 0, 0});
  bench.transport.watch(-1);
  bench.transport.watch(kWatched);
  bench.transport.wait_until(bench.clock->source().now() + Duration{seconds{1}});
  EXPECT_EQ(bench.recorder.events, Events{"readable 77"});
}

TEST(PtpTransport, hands_over_messages_and_transmit_stamps) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.sockets[bench.transport.socket()->descriptor(Channel::kGeneral)].received.push_back(
      {std::vector<std::uint8_t>(64), 0, 0});
  (void)bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1));
  bench.run_for(seconds{1});
  EXPECT_EQ(bench.recorder.events, (Events{"stamp", "message 64"}));
}

TEST(PtpTransport, reports_an_absent_transmit_stamp_after_its_timeout) {
  Bench bench;
  bench.kernel.gives_tx_stamps = false;
  ASSERT_FALSE(bench.transport.open());
  (void)bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1));
  bench.run_for(seconds{1});
  EXPECT_EQ(bench.recorder.events, (Events{"no stamp"}));
}

TEST(PtpTransport, survives_an_interface_that_is_unplugged_and_comes_back) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_exists = false;
  bench.run_for(seconds{5});
  EXPECT_FALSE(bench.transport.is_up());
  EXPECT_TRUE(bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1)));
  bench.kernel.interface_exists = true;
  bench.kernel.interface_index = 17;
  bench.run_for(seconds{10});
  EXPECT_TRUE(bench.transport.is_up());
  EXPECT_EQ(bench.recorder.events, (Events{"down: interface eth0: no such device", "up"}));
}

TEST(PtpTransport, reopens_when_the_interface_was_replaced_between_two_looks) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_index = 3;
  bench.run_for(seconds{3});
  EXPECT_EQ(bench.recorder.events, (Events{"down: interface eth0: was replaced", "up"}));
  EXPECT_EQ(bench.transport.socket()->interface().index, 3);
}

TEST(PtpTransport, survives_ifconfig_down_and_up) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_flags = IFF_BROADCAST;
  bench.kernel.receive_errno = ENETDOWN;
  bench.kernel.sockets[bench.transport.socket()->descriptor(Channel::kEvent)].received.push_back(
      {});
  bench.run_for(seconds{2});
  bench.kernel.interface_flags = IFF_UP | IFF_RUNNING;
  bench.run_for(seconds{10});
  EXPECT_EQ(bench.recorder.events, (Events{"down: interface eth0: the interface is down", "up"}));
}

TEST(PtpTransport, keeps_its_sockets_while_the_carrier_is_away) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  const int descriptor = bench.transport.socket()->descriptor(Channel::kEvent);
  bench.kernel.interface_flags = IFF_UP;
  bench.run_for(seconds{2});
  EXPECT_FALSE(bench.transport.is_up());
  bench.kernel.interface_flags = IFF_UP | IFF_RUNNING;
  bench.run_for(seconds{2});
  EXPECT_EQ(bench.recorder.events, (Events{"down: interface eth0: no carrier", "up"}));
  EXPECT_EQ(bench.transport.socket()->descriptor(Channel::kEvent), descriptor);
}

// Some virtual interfaces never say that they have a carrier: the port is up all the same.
TEST(PtpTransport, a_carrier_that_is_missing_at_the_start_is_known_and_its_coming_is_told) {
  Bench bench;
  bench.kernel.interface_flags = IFF_UP;
  ASSERT_FALSE(bench.transport.open_or_wait());
  bench.run_for(seconds{2});
  EXPECT_TRUE(bench.transport.is_up());
  EXPECT_FALSE(bench.transport.has_carrier());
  bench.kernel.interface_flags = IFF_UP | IFF_RUNNING;
  bench.run_for(seconds{2});
  EXPECT_TRUE(bench.transport.has_carrier());
  EXPECT_EQ(bench.recorder.events, Events{"up"});
}

TEST(PtpTransport, looks_at_the_link_at_once_when_sending_fails) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_exists = false;
  bench.kernel.send_errno = ENODEV;
  (void)bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1));
  bench.transport.wait_until(bench.clock->source().now());
  EXPECT_EQ(bench.recorder.events, (Events{"down: interface eth0: no such device"}));
}

// Syncs came on, requests had no sender to be answered: not a line until the end.
TEST(PtpTransport, an_address_that_is_taken_away_is_said_and_waited_for) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_has_address = false;
  bench.run_for(seconds{2});
  ASSERT_EQ(bench.recorder.events.size(), 1U);
  EXPECT_EQ(bench.recorder.events[0].find("down: interface eth0"), 0U);
  bench.kernel.interface_has_address = true;
  bench.run_for(seconds{10});
  ASSERT_EQ(bench.recorder.events.size(), 2U);
  EXPECT_EQ(bench.recorder.events[1], "up");
}

TEST(PtpTransport,
     an_interface_that_is_late_at_the_start_is_waited_for_and_each_reason_is_said_once) {
  Bench bench;
  bench.kernel.interface_flags = IFF_BROADCAST;
  bench.kernel.interface_has_address = false;
  ASSERT_FALSE(bench.transport.open_or_wait());
  EXPECT_FALSE(bench.transport.is_up());
  bench.run_for(seconds{60});
  bench.kernel.interface_flags = IFF_UP | IFF_RUNNING;
  bench.run_for(seconds{60});
  ASSERT_TRUE(bench.transport.closed());
  EXPECT_EQ(bench.transport.closed()->kind, OsErrorKind::kNoAddress);
  bench.kernel.interface_has_address = true;
  bench.run_for(seconds{2});  // soon after, however long it has waited
  EXPECT_TRUE(bench.transport.is_up());
  EXPECT_FALSE(bench.transport.closed());
  EXPECT_EQ(bench.recorder.events,
            (Events{"down: interface eth0: the interface is down",
                    "down: interface eth0: no IP address of the version asked for", "up"}));
}

TEST(PtpTransport, an_interface_that_does_not_exist_at_the_start_is_not_waited_for) {
  Bench bench;
  bench.kernel.interface_exists = false;
  const auto error = bench.transport.open_or_wait();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind, OsErrorKind::kNoSuchInterface);
  EXPECT_TRUE(bench.recorder.events.empty());
}

TEST(PtpTransport, a_full_queue_says_nothing_of_the_link) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.interface_exists = false;
  bench.kernel.send_errno = EAGAIN;
  EXPECT_TRUE(bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1)));
  bench.transport.wait_until(bench.clock->source().now());
  EXPECT_TRUE(bench.recorder.events.empty()) << "the link is looked at when that is due";
}

TEST(PtpTransport, a_transient_send_error_closes_nothing) {
  Bench bench;
  ASSERT_FALSE(bench.transport.open());
  bench.kernel.send_errno = ENOBUFS;
  EXPECT_TRUE(bench.transport.send(Channel::kEvent, std::vector<std::uint8_t>(44, 1)));
  bench.kernel.send_errno = 0;
  bench.run_for(seconds{2});
  EXPECT_TRUE(bench.transport.is_up());
  EXPECT_TRUE(bench.recorder.events.empty());
}

}  // namespace
}  // namespace ftcs::platform
