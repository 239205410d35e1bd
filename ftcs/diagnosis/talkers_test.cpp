// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/talkers.h"

#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/wire/codec.h"

namespace ftcs::diagnosis {
namespace {

using Octets = std::vector<std::uint8_t>;

Octets announce(std::uint8_t domain) {
  ptp::Message message;
  message.header.domain = domain;
  message.header.source = {ptp::ClockIdentity{{1, 2, 3, 4, 5, 6, 7, 8}}, 9};
  message.header.flags = ptp::flag::kPtpTimescale;
  ptp::Announce body;
  body.utc_offset = 37;
  message.body = body;
  const auto bytes = ptp::encode(message);
  const auto view = bytes->view();
  return {view.begin(), view.end()};
}

Octets joined(std::initializer_list<Octets> parts) {
  Octets all;
  for (const Octets& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

const Octets kAddresses{0x01, 0x1B, 0x19, 0, 0, 0, 2, 2, 2, 2, 2, 2};

Octets ipv4(std::uint16_t port, const Octets& payload) {
  Octets packet(28, 0);
  packet[0] = 0x45;
  packet[9] = 17;
  packet[22] = static_cast<std::uint8_t>(port >> 8);
  packet[23] = static_cast<std::uint8_t>(port);
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

TEST(Talkers, a_frame_tells_way_vlan_domain_and_what_is_announced) {
  Talkers talkers;
  talkers.on_frame(joined({kAddresses, {0x81, 0x00, 0x60, 0x07, 0x88, 0xF7}, announce(5)}));
  ASSERT_EQ(talkers.all().size(), 1U);
  const Talker& one = talkers.all()[0];
  EXPECT_EQ(one.way, Way::kEthernet);
  EXPECT_EQ(one.vlan, 7);
  EXPECT_EQ(one.domain, 5);
  EXPECT_EQ(one.port.port, 9);
  EXPECT_EQ(one.utc_offset, 37);
  EXPECT_TRUE(one.announces());
  EXPECT_TRUE(one.to_group);
}

TEST(Talkers, udp_is_heard_at_the_ports_of_ptp_alone) {
  Talkers talkers;
  const Octets type{0x08, 0x00};
  talkers.on_frame(joined({kAddresses, type, ipv4(123, announce(0))}));
  EXPECT_TRUE(talkers.all().empty());
  talkers.on_frame(joined({kAddresses, type, ipv4(320, announce(0))}));
  talkers.on_frame(joined({kAddresses, type, ipv4(320, announce(0))}));
  ASSERT_EQ(talkers.all().size(), 1U);
  EXPECT_EQ(talkers.all()[0].way, Way::kUdpIpv4);
  EXPECT_EQ(talkers.all()[0].count(ptp::MessageType::kAnnounce), 2U);
}

TEST(Talkers, our_own_messages_are_nobodys) {
  Talkers talkers;
  talkers.set_own(ptp::ClockIdentity{{1, 2, 3, 4, 5, 6, 7, 8}});
  talkers.on_message(announce(0), Way::kUdpIpv6);
  EXPECT_TRUE(talkers.all().empty());
}

TEST(Talkers, what_is_cut_short_is_not_read) {
  const Octets whole =
      joined({kAddresses, {0x81, 0x00, 0x60, 0x07, 0x08, 0x00}, ipv4(319, announce(0))});
  Talkers talkers;
  for (std::size_t size = 0; size < whole.size() - 64; ++size) {
    talkers.on_frame({whole.data(), size});
  }
  EXPECT_TRUE(talkers.all().empty());
}

TEST(Talkers, a_full_table_keeps_whom_it_has) {
  Talkers talkers;
  for (unsigned domain = 0; domain < 200; ++domain) {
    talkers.on_message(announce(static_cast<std::uint8_t>(domain)), Way::kUdpIpv4);
  }
  EXPECT_EQ(talkers.all().size(), Talkers::kCapacity);
  EXPECT_EQ(talkers.all().front().domain, 0);
}

}  // namespace
}  // namespace ftcs::diagnosis
