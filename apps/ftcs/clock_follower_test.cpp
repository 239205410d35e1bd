// SPDX-License-Identifier: MIT
//
// World: a virtual clock, an exact reference, eight exchanges a second, 10 us each way; the log in
// a temporary file.
#include "apps/ftcs/clock_follower.h"

#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "test/support/manual_source.h"

namespace ftcs::app {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kDelay = 10'000;

class Follower : public testing::Test {
 protected:
  Follower() : file(std::tmpfile()), log(kernel, file, 4) {
    options.output = Output::kText;
    follower.emplace(options, log, clock, source.now(), false, "test");
  }
  ~Follower() override { std::fclose(file); }

  /// `late`: what the Sync, and nothing else, is late by.
  void exchange(std::int64_t late = 0) {
    at += kSecond / 8;
    source.instant = FreeRunningTime::from_ns(at + kDelay + late);
    EXPECT_FALSE(
        follower->on_pair({Direction::kForward, ReferenceTime::from_ns(at), source.instant},
                          source.now(), std::nullopt));
    follower->on_silence();
    const std::int64_t sent = at + 3 * kDelay + late;
    source.instant = FreeRunningTime::from_ns(sent);
    EXPECT_FALSE(follower->on_pair(
        {Direction::kBackward, ReferenceTime::from_ns(sent + kDelay), source.instant}, source.now(),
        std::nullopt));
  }
  /// Syncs that were held up and come 5 ms apart, from a transmitter that announces 125 ms.
  void burst(int syncs) {
    for (int i = 0; i < syncs; ++i) {
      at += 5'000'000;
      source.instant = FreeRunningTime::from_ns(at + kDelay);
      EXPECT_FALSE(
          follower->on_pair({Direction::kForward, ReferenceTime::from_ns(at), source.instant},
                            source.now(), Duration::from_whole_ns(kSecond / 8)));
    }
  }
  std::string logged() {
    std::rewind(file);
    std::string text;
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
      text.push_back(static_cast<char>(c));
    }
    return text;
  }

  platform::LinuxKernel kernel;
  std::FILE* file;
  Log log;
  PtpOptions options;
  test::ManualSource source;
  VirtualClock clock{source, {}};
  std::optional<ClockFollower> follower;
  std::int64_t at = 0;
};

TEST_F(Follower, holdover_for_want_of_messages_says_so) {
  for (int i = 0; i < 40; ++i) exchange();
  source.instant = FreeRunningTime::from_ns(at + kSecond);
  follower->on_silence();
  EXPECT_NE(logged().find("test: no Sync for a while; keeping"), std::string::npos) << logged();
}

TEST_F(Follower, a_burst_of_held_up_messages_is_no_shorter_interval) {
  burst(6);
  source.instant = source.instant + Duration::from_whole_ns(kSecond / 8);
  follower->on_silence();
  EXPECT_EQ(logged(), "");
}

TEST_F(Follower, holdover_because_messages_are_refused_says_that_instead) {
  for (int i = 0; i < 40; ++i) exchange();
  for (int i = 0; i < 5; ++i) exchange(1'000'000);
  EXPECT_NE(logged().find("test: 4 Syncs refused, no good one for a while; keeping"),
            std::string::npos)
      << logged();
}

}  // namespace
}  // namespace ftcs::app
