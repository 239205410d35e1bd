// SPDX-License-Identifier: MIT
// World: the interface "eth0" of a fake kernel whose every call can be made to fail; one test sends
// itself a message through the machine's loopback, on unprivileged ports.
#include "ftcs/platform/ptp_socket.h"

#include <arpa/inet.h>
#include <chrono>
#include <cstring>
#include <linux/if_packet.h>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::platform {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::int64_t kMillisecond = 1'000'000;

Bytes message(std::uint8_t sequence) {
  Bytes bytes(44, 0);
  bytes[0] = 1;
  bytes[31] = sequence;
  return bytes;
}

struct Bench {
  FakeKernel kernel;
  PtpSocketConfig config;
  std::unique_ptr<TimestampClock> clock;

  Bench() { config.interface = "eth0"; }
  Result<PtpSocket, OsError> open(TimestampMode mode = TimestampMode::kBestAvailable) {
    auto opened = TimestampClock::open(kernel, config.interface, mode);
    if (!opened) return opened.error();
    clock = std::move(*opened);
    return PtpSocket::open(kernel, config, *clock);
  }
  OsErrorKind failure(TimestampMode mode = TimestampMode::kBestAvailable) {
    const auto socket = open(mode);
    return socket ? OsErrorKind::kSystem : socket.error().kind;
  }
};

TEST(PtpSocket, says_what_could_not_be_had) {
  Bench bench;
  bench.kernel.interface_exists = false;
  EXPECT_EQ(bench.failure(), OsErrorKind::kNoSuchInterface);
  bench.kernel.interface_exists = true;
  bench.kernel.interface_flags = IFF_BROADCAST;
  EXPECT_EQ(bench.failure(), OsErrorKind::kInterfaceDown);
  bench.kernel.interface_flags = IFF_UP;
  bench.kernel.interface_has_address = false;
  EXPECT_EQ(bench.failure(), OsErrorKind::kNoAddress);
  bench.kernel.interface_has_address = true;
  bench.kernel.bind_errno = EACCES;
  EXPECT_EQ(bench.failure(), OsErrorKind::kNotPermitted);
  EXPECT_EQ(bench.open().error().message(),
            "UDP port 319 (below 1024): not permitted (run as root or grant the capability)");
  bench.kernel.bind_errno = EADDRINUSE;
  const auto busy = bench.open();
  ASSERT_FALSE(busy.ok());
  EXPECT_EQ(busy.error().kind, OsErrorKind::kAddressInUse);
  EXPECT_EQ(busy.error().message(), "UDP port 319: already in use by another program");
}

TEST(PtpSocket, closes_what_it_opened_when_opening_fails) {
  Bench bench;
  bench.kernel.bind_errno = EADDRINUSE;
  (void)bench.failure();
  EXPECT_TRUE(bench.kernel.sockets.empty());
}

TEST(PtpSocket, refuses_hardware_stamps_where_there_are_none) {
  Bench bench;
  EXPECT_EQ(bench.failure(TimestampMode::kHardware), OsErrorKind::kTimestampingUnsupported);
  bench.kernel.add_adapter_clock();
  bench.kernel.open_errno = EACCES;
  EXPECT_EQ(bench.failure(TimestampMode::kHardware), OsErrorKind::kNotPermitted);
  bench.kernel.open_errno = ENOENT;
  EXPECT_EQ(bench.failure(TimestampMode::kHardware), OsErrorKind::kNoSuchDevice);
}

TEST(PtpSocket, takes_the_best_stamps_there_are_and_says_which) {
  Bench hardware;
  hardware.kernel.add_adapter_clock();
  EXPECT_EQ(hardware.open()->receive_stamps(), StampSource::kHardware);
  Bench software;
  EXPECT_EQ(software.open()->receive_stamps(), StampSource::kSoftware);
  Bench none;
  none.kernel.timestamping_errno = EINVAL;
  EXPECT_EQ(none.open()->receive_stamps(), StampSource::kUserSpace);
  EXPECT_FALSE(none.open(TimestampMode::kSoftware).ok());
}

// Any host that can route a packet to us was a transmitter.
TEST(PtpSocket, messages_to_an_address_of_our_own_are_heard_only_if_that_is_configured) {
  struct Case {
    UnicastMessages configured;
    bool sync, answer;
  };
  for (const Case& expected :
       {Case{UnicastMessages::kAll, true, true}, Case{UnicastMessages::kDelayAnswers, false, true},
        Case{UnicastMessages::kNone, false, false}}) {
    Bench bench;
    bench.config.unicast_messages = expected.configured;
    auto socket = bench.open();
    ASSERT_TRUE(socket.ok());
    const auto hears = [&](std::uint8_t type, const char* to) {
      Bytes bytes = message(1);
      bytes[0] = type;
      const Channel channel = type < 8 ? Channel::kEvent : Channel::kGeneral;
      FakeKernel::Packet packet{bytes, bench.kernel.realtime_ns, 0};
      packet.destination = in_addr{::inet_addr(to)};
      bench.kernel.sockets[socket->descriptor(channel)].received.push_back(packet);
      const auto received = socket->receive(channel);
      return received.ok() && received->has_value();
    };
    EXPECT_TRUE(hears(0, "224.0.1.129"));
    EXPECT_TRUE(hears(2, "224.0.0.107"));
    EXPECT_EQ(hears(0, "10.77.0.2"), expected.sync);
    EXPECT_EQ(hears(11, "10.77.0.2"), expected.sync);
    EXPECT_EQ(hears(9, "10.77.0.2"), expected.answer);
    EXPECT_EQ(socket->counters().unicast_dropped,
              (expected.sync ? 0U : 2U) + (expected.answer ? 0U : 1U));
  }
}

TEST(PtpSocket, ethernet_frames_to_our_own_address_are_dropped_alike) {
  Bench bench;
  bench.config.transport = NetworkTransport::kEthernet;
  bench.config.unicast_messages = UnicastMessages::kNone;
  auto socket = bench.open();
  ASSERT_TRUE(socket.ok());
  for (const bool to_us : {true, false}) {
    sockaddr_storage storage{};
    sockaddr_ll link{};
    link.sll_family = AF_PACKET;
    link.sll_pkttype = to_us ? PACKET_HOST : PACKET_MULTICAST;
    std::memcpy(&storage, &link, sizeof link);
    bench.kernel.sockets[socket->descriptor(Channel::kEvent)].received.push_back(
        {message(1), bench.kernel.realtime_ns, 0, SocketAddress::from(storage), {}});
    const auto received = socket->receive(Channel::kEvent);
    EXPECT_EQ(received.ok() && received->has_value(), !to_us);
  }
  EXPECT_EQ(socket->counters().unicast_dropped, 1U);
}

TEST(PtpSocket, a_configured_peer_is_the_only_one_that_is_heard) {
  Bench bench;
  bench.config.unicast = SocketAddress::ipv4({::inet_addr("10.77.0.1")}, 0);
  auto socket = bench.open();
  ASSERT_TRUE(socket.ok());
  for (const char* from : {"10.77.0.1", "10.77.0.3"}) {
    bench.kernel.sockets[socket->descriptor(Channel::kEvent)].received.push_back(
        {message(1),
         bench.kernel.realtime_ns,
         0,
         SocketAddress::ipv4({::inet_addr(from)}, 319),
         {}});
    const auto received = socket->receive(Channel::kEvent);
    EXPECT_EQ(received.ok() && received->has_value(), from == std::string("10.77.0.1"));
  }
  EXPECT_EQ(socket->counters().stranger_dropped, 1U);
}

TEST(PtpSocket, hardware_stamps_are_passed_on_as_they_are) {
  Bench bench;
  bench.kernel.add_adapter_clock();
  auto socket = bench.open(TimestampMode::kHardware);
  ASSERT_TRUE(socket.ok());
  const int fd = socket->descriptor(Channel::kEvent);
  bench.kernel.sockets[fd].received.push_back({message(1), 0, 777});
  const auto received = socket->receive(Channel::kEvent);
  ASSERT_TRUE(received.ok() && received->has_value());
  EXPECT_EQ((*received)->stamp->time, FreeRunningTime::from_ns(777));
}

TEST(PtpSocket, maps_software_stamps_of_both_directions_to_the_raw_clock) {
  Bench bench;
  auto socket = bench.open();
  ASSERT_TRUE(socket.ok());
  const int fd = socket->descriptor(Channel::kEvent);
  const std::int64_t raw = bench.kernel.raw_ns;
  bench.kernel.sockets[fd].received.push_back({message(9), bench.kernel.realtime_ns, 0});
  ASSERT_FALSE(socket->send(Channel::kEvent, message(1)));
  bench.kernel.advance(kMillisecond);
  const auto transmitted = socket->receive_transmitted();
  ASSERT_TRUE(transmitted && transmitted->stamp);
  EXPECT_EQ(transmitted->bytes[31], 1);
  EXPECT_NEAR((transmitted->stamp->time - FreeRunningTime::from_ns(raw)).ns(), 0.0, 100.0);
  const auto received = socket->receive(Channel::kEvent);
  ASSERT_TRUE(received.ok() && received->has_value() && (*received)->stamp);
  EXPECT_NEAR(((*received)->stamp->time - FreeRunningTime::from_ns(raw)).ns(), 0.0, 100.0);
}

TEST(PtpSocket, sends_to_the_groups_of_its_transport_or_to_the_unicast_peer) {
  struct Case {
    NetworkTransport transport;
    const char* primary;
    const char* peer_delay;
    const char* peer;
  };
  for (const Case& one :
       {Case{NetworkTransport::kUdpIpv4, "224.0.1.129", "224.0.0.107", "10.0.0.2"},
        Case{NetworkTransport::kUdpIpv6, "ff0e::181", "ff02::6b", "fe80::1"},
        Case{NetworkTransport::kEthernet, "01-1b-19-00-00-00", "01-80-c2-00-00-0e",
             "02-00-00-00-00-05"}}) {
    SCOPED_TRACE(name(one.transport));
    Bench bench;
    bench.config.transport = one.transport;
    auto multicast = bench.open();
    ASSERT_TRUE(multicast.ok());
    const bool udp = one.transport != NetworkTransport::kEthernet;
    EXPECT_FALSE(multicast->send(Channel::kGeneral, message(1)));
    EXPECT_EQ(bench.kernel.last_destination.host(), one.primary);
    EXPECT_EQ(bench.kernel.last_destination.port(), udp ? 320 : 0);
    EXPECT_FALSE(multicast->send(Channel::kEvent, message(1), Group::kPeerDelay));
    EXPECT_EQ(bench.kernel.last_destination.host(), one.peer_delay);
    EXPECT_EQ(bench.kernel.last_destination.port(), udp ? 319 : 0);
    bench.config.unicast = parse_peer(one.transport, one.peer);
    ASSERT_TRUE(bench.config.unicast.has_value());
    auto unicast = bench.open();
    EXPECT_FALSE(unicast->send(Channel::kEvent, message(1), Group::kPeerDelay));
    EXPECT_EQ(bench.kernel.last_destination.host(), one.peer);
    EXPECT_EQ(bench.kernel.last_destination.port(), udp ? 319 : 0);
  }
}

TEST(PtpSocket, an_answer_goes_back_to_where_the_question_came_from) {
  Bench bench;
  auto socket = bench.open();
  const auto peer = parse_peer(NetworkTransport::kUdpIpv4, "10.0.0.9")->with_port(40'000);
  EXPECT_FALSE(socket->send_to(Channel::kGeneral, message(1), peer));
  EXPECT_EQ(bench.kernel.last_destination.host(), "10.0.0.9");
  EXPECT_EQ(bench.kernel.last_destination.port(), 320);
}

TEST(PtpSocket, event_messages_over_ipv6_end_with_two_octets_more_and_are_stamped_all_the_same) {
  Bench bench;
  bench.config.transport = NetworkTransport::kUdpIpv6;
  auto socket = bench.open();
  EXPECT_FALSE(socket->send(Channel::kGeneral, message(1)));
  EXPECT_EQ(bench.kernel.sent.back().bytes.size(), message(1).size());
  EXPECT_FALSE(socket->send(Channel::kEvent, message(7)));
  EXPECT_EQ(bench.kernel.sent.back().bytes.size(), message(7).size() + 2);
  const auto stamped = socket->receive_transmitted();
  ASSERT_TRUE(stamped && stamped->stamp);
  EXPECT_EQ(stamped->bytes[31], 7);
}

TEST(PtpSocket, over_ethernet_it_needs_no_address_and_says_that_it_needs_a_right) {
  Bench bench;
  bench.config.transport = NetworkTransport::kEthernet;
  bench.kernel.interface_has_address = false;
  auto socket = bench.open();
  ASSERT_TRUE(socket.ok());
  for (const Channel channel : {Channel::kEvent, Channel::kGeneral}) {
    const auto& opened = bench.kernel.sockets[socket->descriptor(channel)];
    EXPECT_EQ(opened.family, AF_PACKET);
    // Before it is bound, so that nothing slips by.
    EXPECT_EQ(opened.options.front(), (std::pair{SOL_SOCKET, SO_ATTACH_FILTER}));
  }
  bench.kernel.packet_socket_errno = EPERM;
  const auto refused = bench.open();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, OsErrorKind::kNotPermitted);
}

TEST(PtpSocket, an_interrupted_call_is_no_error) {
  Bench bench;
  auto socket = bench.open();
  bench.kernel.receive_errno = EINTR;
  const auto received = socket->receive(Channel::kEvent);
  ASSERT_TRUE(received.ok());
  EXPECT_FALSE(received->has_value());
  bench.kernel.receive_errno = EINTR;
  EXPECT_FALSE(socket->receive_transmitted().has_value());
  bench.kernel.send_errno = EINTR;
  EXPECT_TRUE(socket->send(Channel::kGeneral, message(1)).has_value());
}

TEST(PtpSocket, reports_a_missing_transmit_stamp_once_and_still_matches_it_when_it_comes_late) {
  Bench bench;
  bench.kernel.gives_tx_stamps = false;
  auto socket = bench.open();
  (void)socket->send(Channel::kEvent, message(1));
  const std::int64_t sent_at = bench.kernel.realtime_ns;
  EXPECT_FALSE(socket->overdue());
  bench.kernel.advance(11 * kMillisecond);
  const auto overdue = socket->overdue();
  ASSERT_TRUE(overdue);
  EXPECT_FALSE(overdue->stamp);
  EXPECT_FALSE(socket->overdue());
  EXPECT_EQ(socket->counters().transmit_stamp_missing, 1U);

  (void)socket->send(Channel::kEvent, message(2));
  bench.kernel.queue_tx_stamp(socket->descriptor(Channel::kEvent), message(1), sent_at, 0);
  const auto late = socket->receive_transmitted();
  ASSERT_TRUE(late && late->stamp);
  EXPECT_EQ(late->bytes[31], 1);
  EXPECT_EQ(socket->counters().transmit_stamp_late, 1U);
}

TEST(PtpSocket, falls_back_to_user_space_when_the_driver_never_stamps) {
  Bench bench;
  bench.kernel.gives_tx_stamps = false;
  auto socket = bench.open();
  for (std::uint8_t i = 0; i < 8; ++i) {
    (void)socket->send(Channel::kEvent, message(i));
    bench.kernel.advance(11 * kMillisecond);
    (void)socket->overdue();
  }
  EXPECT_EQ(socket->transmit_stamps(), StampSource::kUserSpace);
  (void)socket->send(Channel::kEvent, message(99));
  const auto stamped = socket->overdue();
  ASSERT_TRUE(stamped && stamped->stamp);
  EXPECT_EQ(stamped->stamp->source, StampSource::kUserSpace);
}

TEST(PtpSocket, a_message_without_a_kernel_stamp_or_from_before_a_clock_step_has_none) {
  Bench bench;
  auto socket = bench.open();
  const int fd = socket->descriptor(Channel::kEvent);
  bench.kernel.sockets[fd].received.push_back({message(1), 0, 0});
  EXPECT_FALSE((*socket->receive(Channel::kEvent))->stamp);
  bench.kernel.sockets[fd].received.push_back({message(2), bench.kernel.realtime_ns, 0});
  bench.kernel.realtime_ns += 1000 * kMillisecond;
  EXPECT_FALSE((*socket->receive(Channel::kEvent))->stamp);
  EXPECT_EQ(socket->counters().receive_stamp_missing, 2U);
  EXPECT_EQ(bench.clock->foreign_steps(), 1U);
}

TEST(PtpSocket, drops_and_counts_oversized_datagrams) {
  Bench bench;
  auto socket = bench.open();
  const int fd = socket->descriptor(Channel::kGeneral);
  bench.kernel.sockets[fd].received.push_back({Bytes(9000, 1), 0, 0});
  EXPECT_FALSE(socket->receive(Channel::kGeneral)->has_value());
  EXPECT_EQ(socket->counters().oversized, 1U);
}

TEST(PtpSocket, hears_itself_on_the_machines_loopback_with_kernel_stamps_in_order) {
  LinuxKernel kernel;
  PtpSocketConfig config;
  config.interface = "lo";
  // Ports of this process alone, below the range of ephemeral ports.
  config.event_port = static_cast<std::uint16_t>(20000 + 2 * (getpid() % 5000));
  config.general_port = static_cast<std::uint16_t>(config.event_port + 1);
  auto clock = TimestampClock::open(kernel, "lo", TimestampMode::kSoftware);
  ASSERT_TRUE(clock.ok());
  auto socket = PtpSocket::open(kernel, config, **clock);
  if (!socket) GTEST_SKIP() << "no multicast on loopback here: " << socket.error().message();
  const FreeRunningTime before = (*clock)->source().now();
  std::optional<Stamp> sent;
  std::optional<Stamp> received;
  for (int i = 0; i < 100 && !(sent && received); ++i) {
    // The kernel switches receive stamps on a moment after it was asked: the first message may have
    // none.
    if (i % 10 == 0) {
      sent.reset();
      received.reset();
      if (const auto error = socket->send(Channel::kEvent, message(5))) FAIL() << error->message();
    }
    std::array<pollfd, 1> poll{{{socket->descriptor(Channel::kEvent), POLLIN | POLLPRI, 0}}};
    (void)kernel.poll(poll, 10);
    if ((poll[0].revents & (POLLPRI | POLLERR)) != 0) {
      if (const auto stamped = socket->receive_transmitted()) sent = stamped->stamp;
    }
    if ((poll[0].revents & POLLIN) != 0) {
      const auto message = socket->receive(Channel::kEvent);
      if (message.ok() && message->has_value()) received = (*message)->stamp;
    }
  }
  const FreeRunningTime after = (*clock)->source().now();
  ASSERT_TRUE(sent && received);
  constexpr Duration kMappingError{std::chrono::microseconds{1}};
  EXPECT_GE(sent->time + kMappingError, before);
  EXPECT_GE(received->time + kMappingError, sent->time);
  EXPECT_GE(after + kMappingError, received->time);
}

}  // namespace
}  // namespace ftcs::platform
