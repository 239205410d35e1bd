// SPDX-License-Identifier: MIT
//
// The world: a ptp4l that reports one Sync or Delay_Req a datagram, made here octet by octet.
#include "ftcs/ptp/monitor_source.h"

#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/monitor_fixture.h"

namespace ftcs::ptp {
namespace {

constexpr std::int64_t kStart = 1'795'299'184'000'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;
using fake::report;

std::vector<std::uint8_t> sync(std::uint16_t sequence, std::int64_t ns,
                               std::uint8_t transmitter = 0xA) {
  return report(true, sequence, kStart + ns, kStart + ns + 2000, transmitter);
}

/// A source and the free-running clock behind the stamps, from which somebody may have stepped
/// away.
struct Reports {
  MonitorSource source;
  std::int64_t stepped_by = 0;

  std::vector<MonitorSource::Event> on(std::span<const std::uint8_t> bytes) {
    std::vector<MonitorSource::Event> events;
    const MonitorReport report = source.on_datagram(bytes);
    for (const MonitorSample& sample : report.view()) {
      const auto local = FreeRunningTime::from_ns(sample.local_ns - stepped_by);
      if (const auto event = source.on_sample(sample, local)) events.push_back(*event);
    }
    return events;
  }
};

TEST(MonitorSource, HandsSamplesOn) {
  Reports reports;
  const auto first = reports.on(sync(0, 0));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_FALSE(first[0].new_reference);
  EXPECT_EQ(first[0].pair.free_running, FreeRunningTime::from_ns(kStart + 2000));
  EXPECT_FALSE(reports.source.sync_interval().has_value());
  EXPECT_EQ(reports.on(sync(1, kSecond / 8)).size(), 1U);
  EXPECT_EQ(reports.source.sync_interval(), Duration{Nanoseconds{kSecond / 8}});
  const auto delay = reports.on(report(false, 0, kStart + 5000, kStart + 3000));
  ASSERT_EQ(delay.size(), 1U);
  EXPECT_EQ(delay[0].pair.direction, Direction::kBackward);
  EXPECT_EQ(delay[0].pair.reference, ReferenceTime::from_ns(kStart + 5000));
  EXPECT_EQ(reports.source.counters().syncs, 2U);
  EXPECT_EQ(reports.source.counters().delays, 1U);
}

TEST(MonitorSource, CountsGapsAndDropsRepetitions) {
  Reports reports;
  (void)reports.on(sync(65534, 0));
  EXPECT_TRUE(reports.on(sync(65534, 0)).empty());
  EXPECT_EQ(reports.on(sync(1, 3 * kSecond)).size(), 1U);
  EXPECT_EQ(reports.source.counters().repeated, 1U);
  EXPECT_EQ(reports.source.counters().missed_syncs, 2U);
  EXPECT_EQ(reports.source.counters().restarts, 0U);
}

TEST(MonitorSource, ARestartedSequenceGoesOn) {
  Reports reports;
  (void)reports.on(sync(5000, 0));
  const auto events = reports.on(sync(0, 4 * kSecond));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_FALSE(events[0].new_reference);
  EXPECT_EQ(reports.source.counters().restarts, 1U);
}

TEST(MonitorSource, AnotherTransmitterIsAnotherReference) {
  Reports reports;
  (void)reports.on(sync(0, 0));
  const auto events = reports.on(sync(7, kSecond, 0xB));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_TRUE(events[0].new_reference);
  EXPECT_EQ(reports.source.counters().transmitter_changes, 1U);
  EXPECT_FALSE(reports.on(sync(8, 2 * kSecond, 0xB)).at(0).new_reference);
}

TEST(MonitorSource, AJumpOfTheReferenceIsNoticedOnce) {
  for (const std::int64_t jump : {kSecond, -kSecond}) {
    Reports reports;
    (void)reports.on(sync(0, 0));
    const auto leapt =
        reports.on(report(true, 1, kStart + kSecond + jump, kStart + kSecond + 2000));
    EXPECT_TRUE(leapt.at(0).new_reference);
    const auto after =
        reports.on(report(true, 2, kStart + 2 * kSecond + jump, kStart + 2 * kSecond + 2000));
    EXPECT_FALSE(after.at(0).new_reference);
    EXPECT_EQ(reports.source.counters().reference_jumps, 1U);
  }
}

TEST(MonitorSource, AStepOfTheClockIsNoJumpOfTheReference) {
  for (const std::int64_t step : {100 * kSecond, -100 * kSecond}) {
    Reports reports;
    (void)reports.on(sync(0, 0));
    reports.stepped_by = step;
    const auto after =
        reports.on(report(true, 1, kStart + kSecond, kStart + kSecond + 2000 + step));
    ASSERT_EQ(after.size(), 1U);
    EXPECT_FALSE(after[0].new_reference);
    EXPECT_EQ(after[0].pair.free_running, FreeRunningTime::from_ns(kStart + kSecond + 2000));
    EXPECT_EQ(reports.source.counters().reference_jumps, 0U);
    // And a jump does not hide behind a step of the same size.
    reports.stepped_by = 2 * step;
    const auto leapt = reports.on(
        report(true, 2, kStart + 2 * kSecond + step, kStart + 2 * kSecond + 2000 + 2 * step));
    EXPECT_TRUE(leapt.at(0).new_reference);
  }
}

TEST(MonitorSource, CountsWhatItCannotRead) {
  Reports reports;
  auto broken = sync(0, 0);
  broken[47] = 200;
  EXPECT_TRUE(reports.on(broken).empty());
  EXPECT_TRUE(reports.on({}).empty());
  auto unknown = sync(0, 0);
  unknown[44] = 0x12;
  EXPECT_TRUE(reports.on(unknown).empty());
  EXPECT_EQ(reports.source.counters().malformed, 2U);
  EXPECT_EQ(reports.source.counters().unknown_tlvs, 1U);
}

TEST(MonitorSource, NeedsNoHeap) {
  MonitorSource source;
  const auto bytes = sync(0, 0);
  const test::ForbidAllocation forbidden;
  const MonitorReport report = source.on_datagram(bytes);
  ASSERT_EQ(report.size, 1);
  EXPECT_TRUE(source.on_sample(report.samples[0], FreeRunningTime{}).has_value());
}

}  // namespace
}  // namespace ftcs::ptp
