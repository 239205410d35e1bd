// SPDX-License-Identifier: MIT
//
// The world: what Debian's ptp4l 3.1.1 sent to its slave_event_monitor (recorded), and what is made
// of it by hand.
#include "ftcs/ptp/wire/monitor.h"

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {

std::vector<std::uint8_t> octets(std::string_view hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(
        static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

const std::vector<std::uint8_t> kSync = octets(
    "0c02005c000000000000000000000000000000004ac75ffffead68f800000001057fffffffffffffffffffff"
    "8004002c26bc4bfffe7b3d3f0001000400006b0217703a5b9e6500000000000000000000000000006b0217703a5b"
    "a68c");
const std::vector<std::uint8_t> kDelay = octets(
    "0c020058000000000000000000000000000000004ac75ffffead68f800000000057fffffffffffffffffffff"
    "7f00002826bc4bfffe7b3d3f0001000000006b0217710af28492000000000000000000006b0217710af28da6");
constexpr std::size_t kTlv = 44;
constexpr std::size_t kCorrection = kTlv + 4 + 10 + 2 + 10;

constexpr std::int64_t kSecond = 0x6b021770LL * 1'000'000'000;

TEST(Monitor, ReadsWhatPtp4lReported) {
  const auto sync = decode_monitor(kSync);
  ASSERT_TRUE(sync.ok());
  ASSERT_EQ(sync->size, 1);
  const PortIdentity transmitter{ClockIdentity::from_mac({0x26, 0xbc, 0x4b, 0x7b, 0x3d, 0x3f}), 1};
  EXPECT_EQ(sync->samples[0],
            (MonitorSample{Direction::kForward, transmitter, 4,
                           ReferenceTime::from_ns(kSecond + 0x3a5b9e65), kSecond + 0x3a5ba68c}));
  const auto delay = decode_monitor(kDelay);
  ASSERT_TRUE(delay.ok());
  ASSERT_EQ(delay->size, 1);
  EXPECT_EQ(delay->samples[0],
            (MonitorSample{Direction::kBackward, transmitter, 0,
                           ReferenceTime::from_ns(kSecond + 1'000'000'000 + 0x0af28da6),
                           kSecond + 1'000'000'000 + 0x0af28492}));
  EXPECT_EQ(delay->receiver.clock, ClockIdentity::from_mac({0x4a, 0xc7, 0x5f, 0xad, 0x68, 0xf8}));
}

TEST(Monitor, CorrectionsAreAddedForwardAndTakenOffBackward) {
  auto sync = kSync;
  sync[kCorrection + 5] = 10;  // units of 2^-16 ns: 10 ns
  auto delay = kDelay;
  delay[kCorrection + 5] = 10;
  EXPECT_EQ(decode_monitor(sync)->samples[0].reference,
            decode_monitor(kSync)->samples[0].reference + Duration{Nanoseconds{10}});
  EXPECT_EQ(decode_monitor(delay)->samples[0].reference,
            decode_monitor(kDelay)->samples[0].reference - Duration{Nanoseconds{10}});
}

TEST(Monitor, ReadsSeveralElementsAndTlvs) {
  auto bytes = kDelay;
  const std::vector<std::uint8_t> element(kDelay.begin() + kTlv + 14, kDelay.end());
  bytes.insert(bytes.end(), element.begin(), element.end());
  bytes[kTlv + 3] = static_cast<std::uint8_t>(bytes[kTlv + 3] + element.size());
  const std::vector<std::uint8_t> unknown{0x80, 0x05, 0, 2, 1, 2};
  bytes.insert(bytes.end(), unknown.begin(), unknown.end());
  bytes.insert(bytes.end(), kSync.begin() + kTlv, kSync.end());
  bytes[3] = static_cast<std::uint8_t>(bytes.size());
  const auto report = decode_monitor(bytes);
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report->size, 3);
  EXPECT_EQ(report->unknown_tlvs, 1);
  EXPECT_EQ(report->samples[0], report->samples[1]);
  EXPECT_EQ(report->samples[2], decode_monitor(kSync)->samples[0]);
}

TEST(Monitor, RefusesMoreThanAReportHolds) {
  auto bytes = kDelay;
  const std::vector<std::uint8_t> element(kDelay.begin() + kTlv + 14, kDelay.end());
  for (std::size_t i = 1; i <= MonitorReport::kCapacity; ++i) {
    const std::size_t size = 10 + i * element.size();
    bytes[kTlv + 2] = static_cast<std::uint8_t>(size >> 8);
    bytes[kTlv + 3] = static_cast<std::uint8_t>(size);
    bytes[2] = static_cast<std::uint8_t>(bytes.size() >> 8);
    bytes[3] = static_cast<std::uint8_t>(bytes.size());
    ASSERT_TRUE(decode_monitor(bytes).ok()) << i;
    EXPECT_EQ(decode_monitor(bytes)->size, i);
    bytes.insert(bytes.end(), element.begin(), element.end());
  }
  const std::size_t size = 10 + (MonitorReport::kCapacity + 1) * element.size();
  bytes[kTlv + 2] = static_cast<std::uint8_t>(size >> 8);
  bytes[kTlv + 3] = static_cast<std::uint8_t>(size);
  bytes[2] = static_cast<std::uint8_t>(bytes.size() >> 8);
  bytes[3] = static_cast<std::uint8_t>(bytes.size());
  const auto report = decode_monitor(bytes);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().reason, DecodeReason::kOversized);
}

TEST(Monitor, RefusesEveryOtherLength) {
  for (std::size_t size = 0; size < kSync.size(); ++size) {
    EXPECT_FALSE(decode_monitor(std::span(kSync).first(size)).ok());
  }
  auto bytes = kSync;  // the TLV is two octets short, the message whole
  bytes[kTlv + 3] = static_cast<std::uint8_t>(bytes[kTlv + 3] - 2);
  const auto report = decode_monitor(bytes);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().reason, DecodeReason::kMalformedTlv);
}

TEST(Monitor, RefusesABadTimestampAndAnotherMessage) {
  auto bytes = kSync;
  bytes[kSync.size() - 4] = 0xFF;  // 4.28e9 ns
  const auto report = decode_monitor(bytes);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().reason, DecodeReason::kBadTimestamp);
  auto management = kSync;
  management[0] = 0x0D;
  ASSERT_FALSE(decode_monitor(management).ok());
}

TEST(Monitor, NeedsNoHeap) {
  const test::ForbidAllocation forbidden;
  EXPECT_TRUE(decode_monitor(kSync).ok());
}

}  // namespace
}  // namespace ftcs::ptp
