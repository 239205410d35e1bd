// SPDX-License-Identifier: MIT
//
// World: a virtual clock locked to a reference that is exact, a reader in chronyd's place, and a
// system clock that is wrong by a known amount.
#include "apps/ftcs/time_feed.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/platform/local_socket.h"
#include "ftcs/ptp/wire/message.h"
#include "test/support/manual_source.h"

namespace ftcs::app {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kStart = 1'795'299'184 * kSecond;

struct Sample {
  double offset_s = 0.0;
  int leap = 0;
};

class Feed : public testing::Test {
 protected:
  Feed() : reader(std::move(*platform::LocalSocket::client())), log(kernel, stdout, 0) {
    options.interface = "eth0";
    options.chrony_socket = reader.path();
    VirtualClockConfig config;
    config.local = LocalTime::from_ns(kStart);
    clock.emplace(source, config);
    follower.emplace(options, log, *clock, source.now(), false, "test");
  }
  /// One exchange a call, an eighth of a second apart, 10 us each way.
  void exchange() {
    constexpr std::int64_t kDelay = 10'000;
    at += kSecond / 8;
    source.instant = FreeRunningTime::from_ns(at + kDelay);
    EXPECT_FALSE(follower->on_pair(
        {Direction::kForward, ReferenceTime::from_ns(kStart + at), source.instant}, source.now(),
        std::nullopt));
    source.instant = FreeRunningTime::from_ns(at + 2 * kDelay);
    EXPECT_FALSE(follower->on_pair(
        {Direction::kBackward, ReferenceTime::from_ns(kStart + at + 3 * kDelay), source.instant},
        source.now(), std::nullopt));
  }
  void lock() {
    for (int i = 0; i < 40 && !follower->locked(); ++i) exchange();
    ASSERT_TRUE(follower->locked());
  }
  void publish(TimeFeed& feed, std::int64_t system_minus_reference) {
    const LocalTime local = clock->local_at(source.now());
    feed.publish(*follower, local, local.since_epoch().rounded_ns() + system_minus_reference, log);
  }
  std::optional<Sample> read() {
    const auto datagram = reader.receive();
    if (!datagram) return std::nullopt;
    Sample sample;
    std::memcpy(&sample.offset_s, datagram->bytes.data() + 16, sizeof sample.offset_s);
    std::memcpy(&sample.leap, datagram->bytes.data() + 28, sizeof sample.leap);
    return sample;
  }

  platform::LinuxKernel kernel;
  platform::LocalSocket reader;
  PtpOptions options;
  Log log;
  test::ManualSource source;
  std::optional<VirtualClock> clock;
  std::optional<ClockFollower> follower;
  std::int64_t at = 0;
};

TEST_F(Feed, NothingIsSaidBeforeTheLock) {
  auto feed = TimeFeed::open(options);
  ASSERT_TRUE(feed.ok());
  EXPECT_TRUE(feed->is_on());
  publish(*feed, 0);
  EXPECT_FALSE(read().has_value());
}

TEST_F(Feed, ASystemClockThatIsBehindHasAPositiveOffsetAndEachSyncIsToldOnce) {
  auto feed = TimeFeed::open(options);
  lock();
  publish(*feed, -2'000'000);
  const auto sample = read();
  ASSERT_TRUE(sample.has_value());
  EXPECT_NEAR(sample->offset_s, 2e-3, 1e-9);
  publish(*feed, -2'000'000);
  EXPECT_FALSE(read().has_value());
  exchange();
  publish(*feed, 5'000);
  EXPECT_NEAR(read()->offset_s, -5e-6, 1e-9);
}

TEST_F(Feed, TaiIsBroughtToUtc) {
  auto feed = TimeFeed::open(options);
  lock();
  constexpr std::uint16_t kTai = ptp::flag::kPtpTimescale;
  feed->set_scale(reference_scale(kTai | ptp::flag::kUtcOffsetValid, 40));
  publish(*feed, -40 * kSecond);
  EXPECT_NEAR(read()->offset_s, 0.0, 1e-9);
  exchange();
  feed->set_scale(reference_scale(kTai, 40));  // not vouched for: utc_offset of the options
  publish(*feed, -37 * kSecond);
  EXPECT_NEAR(read()->offset_s, 0.0, 1e-9);
}

TEST_F(Feed, TheLeapSecondListTellsWhatTheReferenceDoesNot) {
  const std::string path = reader.path() + ".list";
  constexpr std::int64_t kMidnight = 1'795'305'600 + 2'208'988'800;  // of that day, since 1900
  std::ofstream(path) << 2'272'060'800 << " 33\n" << kMidnight << " 34\n";
  options.leap_file = path;
  auto feed = TimeFeed::open(options);
  ASSERT_TRUE(feed.ok()) << feed.error();
  lock();
  constexpr std::uint16_t kTai = ptp::flag::kPtpTimescale;
  feed->set_scale(reference_scale(kTai, 0));
  publish(*feed, -33 * kSecond);
  const auto sample = read();
  EXPECT_NEAR(sample->offset_s, 0.0, 1e-9);
  EXPECT_EQ(sample->leap, 1);
  exchange();
  feed->set_scale(reference_scale(kTai | ptp::flag::kUtcOffsetValid, 40));  // knows better
  publish(*feed, -40 * kSecond);
  EXPECT_NEAR(read()->offset_s, 0.0, 1e-9);
  exchange();
  feed->set_scale(reference_scale(0, 0));  // UTC already
  publish(*feed, 0);
  EXPECT_NEAR(read()->offset_s, 0.0, 1e-9);
  std::filesystem::remove(path);
  options.leap_file = path;
  EXPECT_FALSE(TimeFeed::open(options).ok());
}

TEST_F(Feed, LeapSecondsAreHandedOn) {
  auto feed = TimeFeed::open(options);
  lock();
  feed->set_scale(reference_scale(ptp::flag::kLeap61, 37));
  publish(*feed, 0);
  EXPECT_EQ(read()->leap, 1);
  exchange();
  feed->set_scale(reference_scale(ptp::flag::kLeap59, 37));
  publish(*feed, 0);
  EXPECT_EQ(read()->leap, 2);
}

TEST_F(Feed, WithoutARequestItIsOff) {
  options.chrony_socket.clear();
  auto feed = TimeFeed::open(options);
  ASSERT_TRUE(feed.ok());
  EXPECT_FALSE(feed->is_on());
  options.chrony_socket = std::string(300, 'x');
  EXPECT_FALSE(TimeFeed::open(options).ok());
}

}  // namespace
}  // namespace ftcs::app
