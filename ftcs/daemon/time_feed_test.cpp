// SPDX-License-Identifier: MIT
//
// World: a virtual clock locked to a reference that is exact, a reader in chronyd's place, and a
// system clock that is wrong by a known amount.
#include "ftcs/daemon/time_feed.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/clock_follower.h"
#include "ftcs/platform/local_socket.h"
#include "ftcs/ptp/wire/message.h"
#include "test/support/manual_source.h"

namespace ftcs::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kMidnight = 1'798'761'600;  // of 2027: leap seconds end a month
constexpr std::int64_t kFrom1900 = 2'208'988'800;
constexpr std::int64_t kStart = (kMidnight - 3'600) * kSecond;

struct Sample {
  double offset_s = 0.0;
  int leap = 0;
};

class Feed : public testing::Test {
 protected:
  Feed() : reader(std::move(*platform::LocalSocket::client())), log(kernel, stdout, 0) {
    options.interface = "eth0";
    options.feeds.chrony_socket = reader.path();
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
    feed.publish(follower->record(), local, source.now(),
                 local.since_epoch().rounded_ns() + system_minus_reference);
  }
  /// What a transmitter of TAI announces, if `flags` say no more.
  void announce(TimeFeed& feed, std::uint16_t flags, int utc_offset = 37) {
    feed.set_scale(reference_scale(ptp::flag::kPtpTimescale | flags, utc_offset));
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
  auto feed = TimeFeed::open(kernel, options, log);
  ASSERT_TRUE(feed.ok());
  EXPECT_TRUE(feed->is_on());
  publish(*feed, 0);
  EXPECT_FALSE(read().has_value());
}

TEST_F(Feed, ASystemClockThatIsBehindHasAPositiveOffsetAndEachSyncIsToldOnce) {
  auto feed = TimeFeed::open(kernel, options, log);
  lock();
  announce(*feed, ptp::flag::kUtcOffsetValid);
  publish(*feed, -37 * kSecond - 2'000'000);
  const auto sample = read();
  ASSERT_TRUE(sample.has_value());
  EXPECT_NEAR(sample->offset_s, 2e-3, 1e-9);
  publish(*feed, -37 * kSecond - 2'000'000);
  EXPECT_FALSE(read().has_value());
  exchange();
  publish(*feed, -37 * kSecond + 5'000);
  EXPECT_NEAR(read()->offset_s, -5e-6, 1e-9);
}

TEST_F(Feed, TaiIsBroughtToUtc) {
  for (const bool vouched_for : {true, false}) {
    options.transmitter.utc_offset = vouched_for ? 37 : 40;
    auto feed = TimeFeed::open(kernel, options, log);
    lock();
    exchange();
    announce(*feed, vouched_for ? ptp::flag::kUtcOffsetValid : 0);
    publish(*feed, -options.transmitter.utc_offset * kSecond);
    const auto sample = read();
    ASSERT_TRUE(sample.has_value());
    EXPECT_NEAR(sample->offset_s, 0.0, 1e-9);
  }
}

// One forged Announce: chrony was told of -32,767 s.
TEST_F(Feed, AnAnnouncedOffsetThatCannotBeTrueIsNotPassedOn) {
  auto feed = TimeFeed::open(kernel, options, log);
  lock();
  announce(*feed, ptp::flag::kUtcOffsetValid);
  for (const int forged : {-32'768, 0, 36, 32'767}) {
    announce(*feed, ptp::flag::kUtcOffsetValid, forged);
    exchange();
    publish(*feed, -37 * kSecond);
    const auto sample = read();
    ASSERT_TRUE(sample.has_value());
    EXPECT_NEAR(sample->offset_s, 0.0, 1e-9) << forged;
  }
  feed->set_scale(reference_scale(0, 0));
  exchange();
  publish(*feed, -37 * kSecond);
  EXPECT_NEAR(read()->offset_s, 0.0, 1e-9) << "PTP_TIMESCALE cleared";
}

TEST_F(Feed, AnArbitraryTimescaleIsPassedOnOnlyIfThatIsAskedFor) {
  for (const bool allowed : {false, true}) {
    options.follower.epoch.any_epoch = allowed;
    auto feed = TimeFeed::open(kernel, options, log);
    lock();
    exchange();
    feed->set_scale(reference_scale(0, 0));  // UTC already
    publish(*feed, 0);
    EXPECT_EQ(read().has_value(), allowed);
  }
}

TEST_F(Feed, AWrongDateIsNotPassedOn) {
  auto feed = TimeFeed::open(kernel, options, log);
  lock();
  announce(*feed, ptp::flag::kUtcOffsetValid);
  publish(*feed, 100'000 * kSecond);
  EXPECT_FALSE(read().has_value()) << "more than a day from the system clock";
}

TEST_F(Feed, TheLeapSecondListTellsWhatTheReferenceDoesNot) {
  const std::string path = reader.path() + ".list";
  std::ofstream(path) << 2'272'060'800 << " 33\n" << kMidnight + kFrom1900 << " 34\n";
  options.clock.leap_file = path;
  auto feed = TimeFeed::open(kernel, options, log);
  ASSERT_TRUE(feed.ok()) << feed.error();
  lock();
  announce(*feed, 0);
  publish(*feed, -33 * kSecond);
  const auto sample = read();
  EXPECT_NEAR(sample->offset_s, 0.0, 1e-9);
  EXPECT_EQ(sample->leap, 1);
  std::filesystem::remove(path);
  options.clock.leap_file = path;
  EXPECT_FALSE(TimeFeed::open(kernel, options, log).ok());
}

TEST_F(Feed, WithoutARequestItIsOff) {
  options.feeds.chrony_socket.clear();
  auto feed = TimeFeed::open(kernel, options, log);
  ASSERT_TRUE(feed.ok());
  EXPECT_FALSE(feed->is_on());
  options.feeds.chrony_socket = std::string(300, 'x');
  EXPECT_FALSE(TimeFeed::open(kernel, options, log).ok());
}

}  // namespace
}  // namespace ftcs::daemon
