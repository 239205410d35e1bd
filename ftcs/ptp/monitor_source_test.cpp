// SPDX-License-Identifier: MIT
//
// The world: a ptp4l that reports one Sync or Delay_Req a datagram, made here octet by octet.
#include "ftcs/ptp/monitor_source.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs::ptp {
namespace {

constexpr std::int64_t kStart = 1'795'299'184'000'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, int octets) {
  for (int i = octets; i-- > 0;) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
void append_time(std::vector<std::uint8_t>& bytes, std::int64_t ns) {
  append(bytes, static_cast<std::uint64_t>(ns / kSecond), 6);
  append(bytes, static_cast<std::uint64_t>(ns % kSecond), 4);
}

/// A Sync that left at `origin` and came at `local`, or a Delay_Req.
std::vector<std::uint8_t> report(bool sync, std::uint16_t sequence, std::int64_t reference,
                                 std::int64_t local, std::uint8_t transmitter = 0xA) {
  std::vector<std::uint8_t> bytes{0x0c, 0x02, 0, static_cast<std::uint8_t>(sync ? 92 : 88)};
  bytes.resize(44);
  append(bytes, sync ? 0x8004 : 0x7F00, 2);
  append(bytes, sync ? 44 : 40, 2);
  append(bytes, 0x020000FFFE000000U + transmitter, 8);
  append(bytes, 1, 2);
  append(bytes, sequence, 2);
  append_time(bytes, sync ? reference : local);
  append(bytes, 0, 8);
  if (sync) append(bytes, 0, 4);
  append_time(bytes, sync ? local : reference);
  return bytes;
}

std::vector<std::uint8_t> sync(std::uint16_t sequence, std::int64_t ns,
                               std::uint8_t transmitter = 0xA) {
  return report(true, sequence, kStart + ns, kStart + ns + 2000, transmitter);
}

TEST(MonitorSource, HandsSamplesOn) {
  MonitorSource source;
  const auto first = source.on_datagram(sync(0, 0));
  ASSERT_EQ(first.size, 1);
  EXPECT_FALSE(first.begin()->new_reference);
  EXPECT_EQ(first.begin()->sample.local_ns, kStart + 2000);
  EXPECT_FALSE(source.sync_interval().has_value());
  EXPECT_EQ(source.on_datagram(sync(1, kSecond / 8)).size, 1);
  EXPECT_EQ(source.sync_interval(), Duration{Nanoseconds{kSecond / 8}});
  const auto delay = source.on_datagram(report(false, 0, kStart + 5000, kStart + 3000));
  ASSERT_EQ(delay.size, 1);
  EXPECT_EQ(delay.begin()->sample.direction, Direction::kBackward);
  EXPECT_EQ(delay.begin()->sample.reference, ReferenceTime::from_ns(kStart + 5000));
  EXPECT_EQ(source.counters().syncs, 2U);
  EXPECT_EQ(source.counters().delays, 1U);
}

TEST(MonitorSource, CountsGapsAndDropsRepetitions) {
  MonitorSource source;
  (void)source.on_datagram(sync(65534, 0));
  EXPECT_EQ(source.on_datagram(sync(65534, 0)).size, 0);
  EXPECT_EQ(source.on_datagram(sync(1, 3 * kSecond)).size, 1);
  EXPECT_EQ(source.counters().repeated, 1U);
  EXPECT_EQ(source.counters().missed_syncs, 2U);
  EXPECT_EQ(source.counters().restarts, 0U);
}

TEST(MonitorSource, ARestartedSequenceGoesOn) {
  MonitorSource source;
  (void)source.on_datagram(sync(5000, 0));
  const auto events = source.on_datagram(sync(0, 4 * kSecond));
  ASSERT_EQ(events.size, 1);
  EXPECT_FALSE(events.begin()->new_reference);
  EXPECT_EQ(source.counters().restarts, 1U);
}

TEST(MonitorSource, AnotherTransmitterIsAnotherReference) {
  MonitorSource source;
  (void)source.on_datagram(sync(0, 0));
  const auto events = source.on_datagram(sync(7, kSecond, 0xB));
  ASSERT_EQ(events.size, 1);
  EXPECT_TRUE(events.begin()->new_reference);
  EXPECT_EQ(source.counters().transmitter_changes, 1U);
  EXPECT_FALSE(source.on_datagram(sync(8, 2 * kSecond, 0xB)).begin()->new_reference);
}

TEST(MonitorSource, AJumpOfTheReferenceIsNoticedOnce) {
  for (const std::int64_t jump : {kSecond, -kSecond}) {
    MonitorSource source;
    (void)source.on_datagram(sync(0, 0));
    const auto leapt =
        source.on_datagram(report(true, 1, kStart + kSecond + jump, kStart + kSecond));
    EXPECT_TRUE(leapt.begin()->new_reference);
    const auto after =
        source.on_datagram(report(true, 2, kStart + 2 * kSecond + jump, kStart + 2 * kSecond));
    EXPECT_FALSE(after.begin()->new_reference);
    EXPECT_EQ(source.counters().reference_jumps, 1U);
  }
}

TEST(MonitorSource, CountsWhatItCannotRead) {
  MonitorSource source;
  auto broken = sync(0, 0);
  broken[47] = 200;
  EXPECT_EQ(source.on_datagram(broken).size, 0);
  EXPECT_EQ(source.on_datagram({}).size, 0);
  auto unknown = sync(0, 0);
  unknown[44] = 0x12;
  EXPECT_EQ(source.on_datagram(unknown).size, 0);
  EXPECT_EQ(source.counters().malformed, 2U);
  EXPECT_EQ(source.counters().unknown_tlvs, 1U);
}

TEST(MonitorSource, NeedsNoHeap) {
  MonitorSource source;
  const auto bytes = sync(0, 0);
  const test::ForbidAllocation forbidden;
  EXPECT_EQ(source.on_datagram(bytes).size, 1);
}

}  // namespace
}  // namespace ftcs::ptp
