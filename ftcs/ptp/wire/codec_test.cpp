// SPDX-License-Identifier: MIT
//
// The world: octets worked out by hand from the tables of IEEE 1588-2019, clause 13, and octets
// that another implementation really sent (ptp4l_messages_test.cpp).
#include "ftcs/ptp/wire/codec.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/wire/fields.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;
using Octets = std::vector<std::uint8_t>;

/// Table 35 and Table 46: Delay_Resp of port 00:1b:19:ff:fe:00:00:01-1 to
/// 00:1b:19:ff:fe:00:00:02-3.
const Octets kDelayResp = {
    0x09, 0x12, 0x00, 0x36,                          // sdo 0, Delay_Resp, 2.1, 54 octets
    0x05, 0x00, 0x04, 0x00,                          // domain 5, unicast
    0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x80, 0x00,  // correction 2.5 ns (5.3.2)
    0x00, 0x00, 0x00, 0x00,                          // messageTypeSpecific
    0x00, 0x1b, 0x19, 0xff, 0xfe, 0x00, 0x00, 0x01, 0x00, 0x01,  // source
    0x12, 0x34, 0x03, 0xfd,  // sequence, control, log interval -3
    0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x07,  // 2 s + 7 ns
    0x00, 0x1b, 0x19, 0xff, 0xfe, 0x00, 0x00, 0x02, 0x00, 0x03};

Message delay_resp() {
  Message message;
  message.header.domain = 5;
  message.header.flags = flag::kUnicast;
  message.header.correction = Duration::from_ns(2.5);
  message.header.source = {{{0x00, 0x1b, 0x19, 0xff, 0xfe, 0x00, 0x00, 0x01}}, 1};
  message.header.sequence_id = 0x1234;
  message.header.log_interval = -3;
  message.body =
      DelayResp{ReferenceTime{2s + 7ns}, {{{0x00, 0x1b, 0x19, 0xff, 0xfe, 0x00, 0x00, 0x02}}, 3}};
  return message;
}

DecodeError error_of(const Octets& octets) {
  const auto result = decode(octets);
  EXPECT_FALSE(result.ok());
  return result.ok() ? DecodeError{} : result.error();
}

TEST(Codec, reads_a_delay_resp_worked_out_by_hand) {
  const auto message = decode(kDelayResp);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(*message, delay_resp());
}

TEST(Codec, writes_a_delay_resp_worked_out_by_hand) {
  const auto bytes = encode(delay_resp());
  ASSERT_TRUE(bytes.ok());
  EXPECT_TRUE(std::ranges::equal(bytes->view(), kDelayResp));
}

TEST(Codec, accepts_version_2_0_and_minor_versions_not_yet_written) {
  for (const int minor : {0, 1, 2, 15}) {
    Octets octets = kDelayResp;
    octets[1] = static_cast<std::uint8_t>(minor << 4 | 2);
    const auto message = decode(octets);
    ASSERT_TRUE(message.ok());
    EXPECT_EQ(message->header.minor_version, minor);
  }
}

TEST(Codec, names_the_version_it_met) {
  Octets octets = kDelayResp;
  octets[1] = 0x01;
  const auto error = error_of(octets);
  EXPECT_EQ(error.reason, DecodeReason::kWrongVersion);
  EXPECT_EQ(error.expected, 2U);
  EXPECT_EQ(error.received, 1U);
  EXPECT_EQ(error.offset, 1U);
}

TEST(Codec, every_truncation_is_an_error_and_none_reads_behind_the_end) {
  for (std::size_t size = 0; size < kDelayResp.size(); ++size) {
    const Octets octets(kDelayResp.begin(), kDelayResp.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(error_of(octets).reason, DecodeReason::kTruncated) << size;
  }
}

TEST(Codec, refuses_what_no_ethernet_frame_can_carry) {
  Octets octets = kDelayResp;
  octets.resize(kMaximumMessageSize);
  EXPECT_TRUE(decode(octets).ok()) << "padding behind messageLength is no fault";
  octets.push_back(0);
  EXPECT_EQ(error_of(octets).reason, DecodeReason::kOversized);
}

TEST(Codec, refuses_reserved_types) {
  for (const int type : {0x4, 0x5, 0x6, 0x7, 0xE, 0xF}) {
    Octets octets = kDelayResp;
    octets[0] = static_cast<std::uint8_t>(type);
    EXPECT_EQ(error_of(octets).reason, DecodeReason::kUnknownType);
  }
}

TEST(Codec, refuses_a_length_that_does_not_hold_the_fixed_part) {
  Octets octets = kDelayResp;
  octets[3] = 53;
  const auto error = error_of(octets);
  EXPECT_EQ(error.reason, DecodeReason::kWrongLength);
  EXPECT_EQ(error.expected, 54U);
  EXPECT_EQ(error.received, 53U);
  octets[3] = 55;
  EXPECT_EQ(error_of(octets).reason, DecodeReason::kTruncated);
}

TEST(Codec, refuses_a_billion_nanoseconds) {
  Octets octets = kDelayResp;
  const Octets billion = {0x3B, 0x9A, 0xCA, 0x00};
  std::ranges::copy(billion, octets.begin() + 40);
  const auto error = error_of(octets);
  EXPECT_EQ(error.reason, DecodeReason::kBadTimestamp);
  EXPECT_EQ(error.expected, 999'999'999U);
  EXPECT_EQ(error.received, 1'000'000'000U);
  EXPECT_EQ(error.offset, 40U);
  octets[43] = 0xFF;
  octets[42] = 0xC9;  // 999,999,999
  EXPECT_TRUE(decode(octets).ok());
}

TEST(Codec, refuses_seconds_that_overflow_64_bit_nanoseconds) {
  Octets octets = kDelayResp;
  std::fill_n(octets.begin() + 34, 6, std::uint8_t{0xFF});
  const auto error = error_of(octets);
  EXPECT_EQ(error.reason, DecodeReason::kBadTimestamp);
  EXPECT_EQ(error.received, (std::uint64_t{1} << 48) - 1);
  EXPECT_EQ(error.offset, 34U);
}

TEST(Codec, the_last_second_that_fits_survives_the_round_trip) {
  Message message = delay_resp();
  const auto last = *from_wire({kMaximumSeconds, 999'999'999});
  std::get<DelayResp>(message.body).receive = last;
  const auto bytes = encode(message);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(*decode(bytes->view()), message);
}

TEST(Codec, skips_well_formed_tlvs) {
  Octets octets = kDelayResp;
  const Octets tlvs = {0x00, 0x08, 0x00, 0x02, 0xAA, 0xBB,  // PATH_TRACE, two octets
                       0x7F, 0xFF, 0x00, 0x00};             // unknown type, empty
  octets.insert(octets.end(), tlvs.begin(), tlvs.end());
  octets[3] = static_cast<std::uint8_t>(octets.size());
  const auto message = decode(octets);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(*message, delay_resp());
}

TEST(Codec, refuses_tlvs_that_are_odd_or_end_behind_the_message) {
  for (const std::uint8_t length : {std::uint8_t{1}, std::uint8_t{4}, std::uint8_t{0xFE}}) {
    Octets octets = kDelayResp;
    const Octets tlv = {0x00, 0x08, 0x00, length, 0xAA, 0xBB};
    octets.insert(octets.end(), tlv.begin(), tlv.end());
    octets[3] = static_cast<std::uint8_t>(octets.size());
    const auto error = error_of(octets);
    EXPECT_EQ(error.reason, DecodeReason::kMalformedTlv);
    EXPECT_EQ(error.received, length);
    EXPECT_EQ(error.expected, length == 1 ? 0U : 2U);
    EXPECT_EQ(error.offset, kDelayResp.size() + 2);
  }
}

TEST(Codec, checks_a_tlv_that_is_only_a_header) {
  Octets octets = kDelayResp;
  octets.insert(octets.end(), {0x00, 0x08, 0x00, 0x02});
  octets[3] = static_cast<std::uint8_t>(octets.size());
  EXPECT_EQ(error_of(octets).reason, DecodeReason::kMalformedTlv);
}

TEST(Codec, a_header_alone_is_asked_for_the_length_that_it_promises) {
  const Octets header(kDelayResp.begin(), kDelayResp.begin() + 34);
  EXPECT_EQ(error_of(header).expected, 54U);
}

TEST(Codec, refuses_to_write_a_time_before_the_epoch) {
  Message message = delay_resp();
  std::get<DelayResp>(message.body).receive = ReferenceTime::from_ns(-1);
  ASSERT_FALSE(encode(message).ok());
  EXPECT_EQ(encode(message).error(), EncodeError::kTimestampOutOfRange);
}

TEST(Codec, refuses_to_write_a_correction_beyond_its_field) {
  Message message = delay_resp();
  message.header.correction = Nanoseconds{std::int64_t{1} << 47};
  ASSERT_FALSE(encode(message).ok());
  EXPECT_EQ(encode(message).error(), EncodeError::kCorrectionOutOfRange);
  message.header.correction = Nanoseconds{-(std::int64_t{1} << 47)};
  const auto bytes = encode(message);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(*decode(bytes->view()), message);
}

TEST(Codec, what_it_writes_it_reads_for_every_type) {
  const PortIdentity port{{{1, 2, 3, 4, 5, 6, 7, 8}}, 0xFFFF};
  const auto time = ReferenceTime::from_ns(1'700'000'000'123'456'789);
  Announce announce{
      .origin = time, .utc_offset = -37, .grandmaster = port.clock, .steps_removed = 300};
  const Body bodies[] = {Sync{time},
                         DelayReq{time},
                         PdelayReq{time},
                         PdelayResp{time, port},
                         FollowUp{time},
                         DelayResp{time, port},
                         PdelayRespFollowUp{time, port},
                         announce,
                         Signaling{port},
                         Management{port, 1, 2, 3}};
  std::mt19937_64 random(7);
  for (const Body& body : bodies) {
    Message message{.header = {.major_sdo_id = 0xF, .minor_version = 0, .minor_sdo_id = 9},
                    .body = body};
    message.header.flags = static_cast<std::uint16_t>(random());
    message.header.correction = Duration::from_scaled_ns(static_cast<std::int64_t>(random()));
    const auto bytes = encode(message);
    ASSERT_TRUE(bytes.ok());
    EXPECT_EQ(bytes->size, size_of(type_of(body)));
    const auto again = decode(bytes->view());
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(*again, message);
  }
}

TEST(Codec, random_octets_are_decoded_or_refused_without_allocation) {
  std::mt19937_64 random(1);
  Octets octets(200);
  const test::ForbidAllocation guard;
  int decoded = 0;
  for (int i = 0; i < 200'000; ++i) {
    for (auto& octet : octets) octet = static_cast<std::uint8_t>(random());
    octets[1] = 2;
    octets[2] = 0;
    decoded += decode({octets.data(), random() % octets.size()}).ok() ? 1 : 0;
  }
  EXPECT_LT(decoded, 200'000);
}

TEST(Identity, is_printed_as_ptp4l_prints_it) {
  const PortIdentity port{ClockIdentity::from_mac({0x00, 0x1b, 0x21, 0xa1, 0xb2, 0xc3}), 65535};
  EXPECT_EQ(to_text(port.clock).view(), "001b21.fffe.a1b2c3");
  EXPECT_EQ(to_text(port).view(), "001b21.fffe.a1b2c3-65535");
}

/// As a bridge sends it: 802.1AS-2020, 11.4.4.3. 2^41 times 1e-6 is 2'199'023.
TEST(FollowUpInformationTlv, is_read_and_written_octet_by_octet) {
  FollowUp body;
  body.has_information = true;
  body.information.cumulative_scaled_rate_offset = 2'199'023;
  body.information.gm_time_base_indicator = 0x0102;
  body.information.last_gm_phase_change = Duration::from_ns(-1.5);
  body.information.scaled_last_gm_freq_change = -1;
  Message message;
  message.body = body;
  const auto bytes = encode(message);
  ASSERT_TRUE(bytes.ok());
  const std::vector<std::uint8_t> tlv(bytes->view().begin() + 44, bytes->view().end());
  EXPECT_EQ(tlv, (std::vector<std::uint8_t>{0x00, 0x03, 0x00, 0x1C, 0x00, 0x80, 0xC2, 0x00,
                                            0x00, 0x01,              // id
                                            0x00, 0x21, 0x8D, 0xEF,  // rate
                                            0x01, 0x02,              // time base
                                            0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
                                            0xFF, 0xFE, 0x80, 0x00, 0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_NEAR(body.information.cumulative_rate_offset(), 1e-6, 1e-12);
  const auto again = decode(bytes->view());
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(*again, message);
}

TEST(FollowUpInformationTlv, of_another_organization_or_length_is_skipped) {
  Message message;
  FollowUp body;
  body.has_information = true;
  message.body = body;
  const auto bytes = encode(message);
  std::vector<std::uint8_t> octets(bytes->view().begin(), bytes->view().end());
  octets[49] = 0x81;  // not 00-80-C2
  EXPECT_FALSE(std::get<FollowUp>(decode(octets)->body).has_information);
  octets[49] = 0x80;
  octets[47] = 26;  // two octets too short: no TLV of ours, and two octets of padding
  EXPECT_FALSE(std::get<FollowUp>(decode(octets)->body).has_information);
  octets[47] = 30;
  EXPECT_EQ(decode(octets).error().reason, DecodeReason::kMalformedTlv);
}

}  // namespace
}  // namespace ftcs::ptp
