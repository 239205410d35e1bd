// SPDX-License-Identifier: MIT
//
// The world: what Debian 12's ptp4l (linuxptp 3.1.1) and pmc really sent over a veth link,
// version 2.0 (minor 0), captured with tcpdump. Beside each message, what `tshark -V` (4.0) read in
// it. ptp4l fills every field as the standard says, so that our encoder must give back the same
// octets.
#include <algorithm>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/wire/codec.h"

namespace ftcs::ptp {
namespace {

std::vector<std::uint8_t> from_hex(std::string_view hex) {
  const auto nibble = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::vector<std::uint8_t> octets;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    octets.push_back(static_cast<std::uint8_t>(nibble(hex[i]) * 16 + nibble(hex[i + 1])));
  }
  return octets;
}

ReferenceTime at(std::int64_t seconds, std::int64_t nanoseconds) {
  return ReferenceTime::from_ns(seconds * 1'000'000'000 + nanoseconds);
}

const PortIdentity kTransmitter{{{0x52, 0x12, 0xe7, 0xff, 0xfe, 0xcb, 0x3d, 0xfd}}, 1};
const PortIdentity kReceiver{{{0x6a, 0xd5, 0x65, 0xff, 0xfe, 0xd5, 0x7a, 0x5e}}, 1};
const PortIdentity kPeerA{{{0x96, 0xdc, 0xeb, 0xff, 0xfe, 0x10, 0xa0, 0x35}}, 1};
const PortIdentity kPeerB{{{0xce, 0x08, 0x95, 0xff, 0xfe, 0x60, 0x68, 0x53}}, 1};

struct Sent {
  std::string_view hex;
  PortIdentity source;
  std::uint16_t sequence_id;
  std::uint16_t flags;
  std::int8_t log_interval;
  Body body;
};

const Sent kMessages[] = {
    // Announce, flags 0, sequence 0, log -2, UTC offset 37, priorities 10 and 128, class 248,
    // accuracy 0xfe,
    // variance 65535, grandmaster 0x5212e7fffecb3dfd, 0 steps removed, INTERNAL_OSCILLATOR (0xa0)
    {"0b020040000000000000000000000000000000005212e7fffecb3dfd0001000005fe0000000000000000000000"
     "25000af8feffff805212e7fffecb3dfd0000a0",
     kTransmitter, 0, 0, -2,
     Announce{.origin = {},
              .utc_offset = 37,
              .priority1 = 10,
              .quality = {248, 0xFE, 65535},
              .priority2 = 128,
              .grandmaster = kTransmitter.clock,
              .steps_removed = 0,
              .time_source = 0xA0}},
    // Sync, PTP_TWO_STEP, sequence 10, log -3, origin 0.000000000
    {"0002002c000002000000000000000000000000005212e7fffecb3dfd0001000a00fd00000000000000000000",
     kTransmitter, 10, flag::kTwoStep, -3, Sync{}},
    // Follow_Up, sequence 10, preciseOriginTimestamp 1795252702 s 224737885 ns
    {"0802002c000000000000000000000000000000005212e7fffecb3dfd0001000a02fd00006b0161de0d653a5d",
     kTransmitter, 10, 0, -3, FollowUp{at(1'795'252'702, 224'737'885)}},
    // Delay_Req, sequence 11, log 127
    {"0102002c000000000000000000000000000000006ad565fffed57a5e0001000b017f00000000000000000000",
     kReceiver, 11, 0, 127, DelayReq{}},
    // Delay_Resp, sequence 11, receiveTimestamp 1795252702 s 673105144 ns, requesting
    // 0x6ad565fffed57a5e port 1
    {"09020036000000000000000000000000000000005212e7fffecb3dfd0001000b03fd00006b0161de281ec4f86a"
     "d565fffed57a5e0001",
     kTransmitter, 11, 0, -3, DelayResp{at(1'795'252'702, 673'105'144), kReceiver}},
    // Pdelay_Req, sequence 0
    {"020200360000000000000000000000000000000096dcebfffe10a03500010000057f0000000000000000000000000"
     "0"
     "00000000000000",
     kPeerA, 0, 0, 127, PdelayReq{}},
    // Pdelay_Resp, PTP_TWO_STEP, requestReceiptTimestamp 1795253329 s 818990876 ns, requesting
    // 0x96dcebfffe10a035
    {"0302003600000200000000000000000000000000ce0895fffe60685300010000057f00006b01645130d0cf1c96dce"
     "b"
     "fffe10a0350001",
     kPeerB, 0, flag::kTwoStep, 127, PdelayResp{at(1'795'253'329, 818'990'876), kPeerA}},
    // Pdelay_Resp_Follow_Up, responseOriginTimestamp 1795253329 s 820582279 ns
    {"0a02003600000000000000000000000000000000ce0895fffe60685300010000057f00006b01645130e9178796dce"
     "b"
     "fffe10a0350001",
     kPeerB, 0, 0, 127, PdelayRespFollowUp{at(1'795'253'329, 820'582'279), kPeerA}},
};

TEST(Ptp4lMessages, are_read_as_tshark_reads_them) {
  for (const Sent& sent : kMessages) {
    SCOPED_TRACE(sent.hex);
    const auto message = decode(from_hex(sent.hex));
    ASSERT_TRUE(message.ok());
    EXPECT_EQ(message->header.minor_version, 0);
    EXPECT_EQ(message->header.domain, 0);
    EXPECT_EQ(message->header.correction, Duration{});
    EXPECT_EQ(message->header.source, sent.source);
    EXPECT_EQ(message->header.sequence_id, sent.sequence_id);
    EXPECT_EQ(message->header.flags, sent.flags);
    EXPECT_EQ(message->header.log_interval, sent.log_interval);
    EXPECT_EQ(message->body, sent.body);
  }
}

TEST(Ptp4lMessages, are_written_octet_by_octet_the_same) {
  for (const Sent& sent : kMessages) {
    SCOPED_TRACE(sent.hex);
    const auto octets = from_hex(sent.hex);
    const auto message = decode(octets);
    ASSERT_TRUE(message.ok());
    const auto bytes = encode(*message);
    ASSERT_TRUE(bytes.ok());
    EXPECT_TRUE(std::ranges::equal(bytes->view(), octets));
  }
}

TEST(Ptp4lMessages, a_management_request_of_pmc_is_read_and_its_tlv_skipped) {
  // Management, targetPortIdentity all ones, hops 1 and 1, action GET, TLV MANAGEMENT (1) of 20
  // octets, CURRENT_DATA_SET
  const auto message = decode(from_hex(
      "0d02004800000000000000000000000000000000ce0895fffe60685300010000047fffffffffffffffffffff0101"
      "0000000100142001000000000000000000000000000000000000"));
  ASSERT_TRUE(message.ok());
  const auto* management = std::get_if<Management>(&message->body);
  ASSERT_NE(management, nullptr);
  EXPECT_EQ(management->target.port, 0xFFFF);
  EXPECT_EQ(management->starting_boundary_hops, 1);
  EXPECT_EQ(management->action, 0);
}

}  // namespace
}  // namespace ftcs::ptp
