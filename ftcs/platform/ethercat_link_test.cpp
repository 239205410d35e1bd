// SPDX-License-Identifier: MIT
#include "ftcs/platform/ethercat_link.h"

#include <cerrno>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::platform {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// Its interface gets a carrier, or none, when the program has slept long enough.
class CableKernel final : public FakeKernel {
 public:
  std::int64_t carrier_at_ns = 0;
  void sleep_until(std::int64_t instant_ns) noexcept override {
    FakeKernel::sleep_until(instant_ns);
    if (raw_ns >= carrier_at_ns) interface_flags |= IFF_RUNNING;
  }
};

/// A whole EtherCAT frame: header and one NOP datagram.
constexpr std::array<std::uint8_t, 16> kFrame{0x0E, 0x10};

TEST(EthercatLink, waits_for_a_carrier_that_is_reported_late) {
  CableKernel kernel;
  kernel.interface_flags = IFF_UP;
  kernel.carrier_at_ns = kernel.raw_ns + kSecond;
  EXPECT_TRUE(EthercatLink::open_raw(kernel, "eth0"));
}

TEST(EthercatLink, names_what_is_wrong_with_an_interface) {
  CableKernel kernel;
  kernel.interface_flags = IFF_UP;
  kernel.carrier_at_ns = kernel.raw_ns + 1000 * kSecond;
  const std::int64_t start = kernel.raw_ns;
  const auto no_carrier = EthercatLink::open_raw(kernel, "eth0");
  ASSERT_FALSE(no_carrier);
  EXPECT_NE(no_carrier.error().message().find("no carrier"), std::string::npos);
  EXPECT_LT(kernel.raw_ns - start, 5 * kSecond);

  kernel.interface_flags = 0;
  const auto down = EthercatLink::open_raw(kernel, "eth0");
  ASSERT_FALSE(down);
  EXPECT_EQ(down.error().kind, OsErrorKind::kInterfaceDown);

  kernel.packet_socket_errno = EPERM;
  EXPECT_FALSE(EthercatLink::open_raw(kernel, "eth0"));
  EXPECT_FALSE(EthercatLink::connect_udp(kernel, "no address", 1));
  EXPECT_TRUE(kernel.sockets.empty());  // closed, whatever went wrong
}

TEST(EthercatLink, sends_ethernet_frames_with_its_own_address) {
  FakeKernel kernel;
  auto link = EthercatLink::open_raw(kernel, "eth0");
  ASSERT_TRUE(link);
  EXPECT_EQ(link->send(kFrame), 0);
  ASSERT_EQ(kernel.sent.size(), 1U);
  const auto& bytes = kernel.sent[0].bytes;
  ASSERT_GE(bytes.size(), 14 + kFrame.size());
  EXPECT_EQ(bytes[0], 0xFF);
  EXPECT_EQ(bytes[7], 0x11);  // 02:11:22:33:44:55 of the fake interface
  EXPECT_EQ(bytes[12], 0x88);
  EXPECT_EQ(bytes[13], 0xA4);
  kernel.send_errno = ENETDOWN;
  EXPECT_EQ(link->send(kFrame), ENETDOWN);
}

TEST(EthercatLink, waits_until_the_deadline_and_no_longer) {
  FakeKernel kernel;
  auto link = EthercatLink::connect_udp(kernel, "127.0.0.1", 1);
  ASSERT_TRUE(link);
  const FreeRunningTime deadline = link->clock().now() + Duration::from_ns(250'000);
  EXPECT_FALSE(link->receive(deadline, false));
  EXPECT_GE(link->clock().now(), deadline);
  EXPECT_LT((link->clock().now() - deadline).ns(), 1'000.0);
}

/// Stamps are of CLOCK_REALTIME, which anybody may set between two frames.
TEST(EthercatLink, a_stamp_means_the_same_instant_before_and_after_the_date_is_set) {
  for (const std::int64_t step : {3'600 * kSecond, -kSecond, std::int64_t{5'000}}) {
    FakeKernel kernel;
    kernel.reading_ns = 0;
    auto link = EthercatLink::connect_udp(kernel, "127.0.0.1", 1);
    ASSERT_TRUE(link);
    for (int i = 0; i < 3; ++i) {
      FakeKernel::Packet packet{{kFrame.begin(), kFrame.end()}, 0, 0};
      packet.software_ns = kernel.realtime_ns;
      kernel.sockets.begin()->second.received.push_back(packet);
      const auto received = link->receive(link->clock().now(), false);
      ASSERT_TRUE(received);
      EXPECT_TRUE(received->by_kernel);
      EXPECT_EQ(received->stamp, link->clock().now());
      kernel.advance(1'000'000);
      kernel.realtime_ns += step;
    }
  }
}

}  // namespace
}  // namespace ftcs::platform
