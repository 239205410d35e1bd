// SPDX-License-Identifier: MIT
//
// World: a virtual clock, an exact reference, eight exchanges a second, 10 us each way; the log in
// a temporary file.
#include "ftcs/daemon/clock_follower.h"

#include <algorithm>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "test/support/manual_source.h"

namespace ftcs::daemon {
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

class PeerToPeerFollower : public Follower {
 protected:
  PeerToPeerFollower() {
    options.protocol.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
    follower.emplace(options, log, clock, source.now(), false, "test");
  }
  void sync(std::int64_t link) {
    at += kSecond / 8;
    source.instant = FreeRunningTime::from_ns(at + link);
    EXPECT_FALSE(
        follower->on_pair({Direction::kForward, ReferenceTime::from_ns(at), source.instant},
                          source.now(), std::nullopt));
  }
  void link_delay(std::int64_t delay) {
    EXPECT_FALSE(follower->on_link_delay({Duration::from_whole_ns(delay), {}, false, {}},
                                         source.now(), std::nullopt));
  }
  [[nodiscard]] std::uint64_t used() const { return follower->discipline().counters().used; }
  [[nodiscard]] double error_ns() {
    return (clock.local_at(source.now()).since_epoch() - source.now().since_epoch()).ns();
  }
};

TEST_F(PeerToPeerFollower, steers_nothing_and_is_not_locked_before_the_link_delay_is_known) {
  for (int i = 0; i < 40; ++i) sync(kDelay);
  EXPECT_EQ(used(), 0U);
  EXPECT_EQ(follower->discipline().counters().commands, 0U);
  EXPECT_FALSE(follower->locked());
  link_delay(kDelay);
  EXPECT_EQ(used(), 1U) << "the newest";
  for (int i = 0; i < 40; ++i) sync(kDelay);
  EXPECT_TRUE(follower->locked());
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(PeerToPeerFollower, another_link_has_no_delay_yet) {
  link_delay(kDelay);
  for (int i = 0; i < 40; ++i) sync(kDelay);
  follower->on_new_link();
  for (int i = 0; i < 3; ++i) sync(5 * kDelay);
  EXPECT_EQ(used(), 40U);
  link_delay(5 * kDelay);
  sync(5 * kDelay);
  EXPECT_EQ(used(), 42U);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(PeerToPeerFollower,
       the_adaptive_servo_has_a_steady_link_delay_unless_the_user_chose_a_filter) {
  const auto link_after_six_late = [this] {
    follower.emplace(options, log, clock, source.now(), false, "test");
    for (int i = 0; i < 100; ++i) link_delay(kDelay + (i % 2 == 0 ? 10 : -10));
    for (int i = 0; i < 6; ++i) link_delay(kDelay + 10);
    sync(kDelay);
    return follower->discipline().counters().used > 0
               ? follower->status(source.now()).last.telemetry.servo.path_delay.ns() - kDelay
               : 0.0;
  };
  options.follower.servo.kind = ServoKind::kAdaptive;
  EXPECT_NEAR(link_after_six_late(), 0.0, 3.0);
  options.follower.filter_is_chosen = true;
  EXPECT_NEAR(link_after_six_late(), 10.0, 1e-6) << "the median of ten";
  options.follower.filter_is_chosen = false;
  options.follower.servo.kind = ServoKind::kFtcs;
  EXPECT_NEAR(link_after_six_late(), 10.0, 1e-6);
}

struct Late {
  std::int64_t request = 0;
  std::int64_t response = 0;
};

/// An exchange 20 ms before the next Sync; the transmitter's stamps are `ahead` of its Syncs.
class NeighbourIsTransmitter : public PeerToPeerFollower {
 protected:
  /// As it happens, but known only when it is handed over.
  [[nodiscard]] ptp::EmitPeerDelay ask(std::int64_t asked, std::int64_t link,
                                       std::int64_t ahead = 0, Late late = {}) const {
    const std::int64_t answered = asked + 5'000'000;
    return {Duration::from_whole_ns(link) +
                Duration::from_whole_ns(late.request + late.response).half(),
            {},
            false,
            ptp::PeerStamps{
                {Direction::kBackward, ReferenceTime::from_ns(asked + link + ahead + late.request),
                 FreeRunningTime::from_ns(asked)},
                {Direction::kForward, ReferenceTime::from_ns(answered + ahead),
                 FreeRunningTime::from_ns(answered + link + late.response)}}};
  }
  void hand_over(const ptp::EmitPeerDelay& exchange) {
    source.instant = std::max(source.instant, exchange.stamps->response.free_running);
    EXPECT_FALSE(follower->on_link_delay(exchange, source.now(), std::nullopt));
  }
  void cycle(std::int64_t link, std::int64_t ahead = 0, Late late = {}) {
    hand_over(ask(at + kSecond / 8 - 20'000'000, link, ahead, late));
    sync(link);
    follower->on_silence();
  }
  /// Noise that repeats after five, 100 ns.
  void noisy_cycle(int i) {
    constexpr std::int64_t kNoise[] = {80, -130, 20, 110, -80};
    cycle(kDelay, 0, {kNoise[i % 5], kNoise[(2 * i + 1) % 5]});
  }
  [[nodiscard]] std::uint64_t heard() const { return follower->discipline().counters().beside; }
};

TEST_F(NeighbourIsTransmitter, its_exchanges_count_and_follow_a_path_that_changes) {
  for (int i = 0; i < 100; ++i) cycle(kDelay);
  EXPECT_EQ(used(), 100U);
  EXPECT_EQ(heard(), 2 * 95U) << "five Syncs make four comparisons";
  for (int i = 0; i < 50; ++i) cycle(kDelay + 3'000);
  EXPECT_NEAR(error_ns(), 0.0, 10.0);
  EXPECT_NEAR(follower->status(source.now()).last.telemetry.servo.path_delay.ns(), kDelay + 3'000,
              10.0);
  EXPECT_EQ(logged(), "") << "no holdover between a response and the next Sync";
}

TEST_F(NeighbourIsTransmitter, the_first_request_heard_may_be_late) {
  for (int i = 0; i < 5; ++i) noisy_cycle(i);
  ASSERT_EQ(heard(), 0U);
  cycle(kDelay, 0, {1'000'000, 0});
  for (int i = 6; i < 20; ++i) {
    EXPECT_NEAR(error_ns(), 0.0, 300.0) << i;
    noisy_cycle(i);
  }
  EXPECT_GT(heard(), 20U);
}

TEST_F(NeighbourIsTransmitter, an_exchange_with_an_impossible_delay_is_not_heard) {
  for (int i = 0; i < 20; ++i) cycle(kDelay);
  const std::uint64_t before = heard();
  cycle(kDelay, 0, {300'000'000, 0});
  EXPECT_EQ(heard(), before);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(NeighbourIsTransmitter, what_is_known_late_is_heard_in_order) {
  for (int i = 0; i < 20; ++i) cycle(kDelay);
  for (int i = 0; i < 20; ++i) {  // the response comes after the Sync, and is known before it
    hand_over(ask(at + kSecond / 8 + 1'000'000, kDelay));
    sync(kDelay);
  }
  for (int i = 0; i < 20; ++i) {  // the response comes before the Sync, and is known after it
    const ptp::EmitPeerDelay exchange = ask(at + kSecond / 8 - 6'000'000, kDelay);
    sync(kDelay);
    hand_over(exchange);
  }
  EXPECT_EQ(used(), 60U);
  EXPECT_TRUE(follower->status(source.now()).refusals.empty());
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(NeighbourIsTransmitter, stamps_of_another_clock_are_never_heard) {
  for (int i = 0; i < 100; ++i) cycle(kDelay, 37 * kSecond);
  EXPECT_EQ(heard(), 0U);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
  EXPECT_EQ(logged(), "") << "they never counted";
}

TEST_F(NeighbourIsTransmitter, stamps_that_depart_from_the_syncs_are_dropped_and_that_is_said) {
  for (int i = 0; i < 100; ++i) cycle(kDelay);
  for (int i = 0; i < 100; ++i) cycle(kDelay, 500);
  EXPECT_NE(logged().find("peer delay messages are 500 ns off its Syncs"), std::string::npos);
  for (int i = 0; i < 100; ++i) cycle(kDelay, 500);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(NeighbourIsTransmitter, a_switch_between_the_two_ends_it_and_the_link_delay_counts) {
  for (int i = 0; i < 100; ++i) cycle(kDelay);
  follower->on_new_link();
  sync(4 * kDelay);
  EXPECT_NEAR(error_ns(), 0.0, 10.0) << "waits for the new link's delay";
  for (int i = 0; i < 40; ++i) {  // a transparent clock now answers
    link_delay(4 * kDelay);
    sync(4 * kDelay);
  }
  EXPECT_NE(logged().find("the neighbour is not the transmitter any more"), std::string::npos);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
}

TEST_F(NeighbourIsTransmitter, a_longer_cable_is_no_step_of_the_clock) {
  for (int i = 0; i < 100; ++i) noisy_cycle(i);
  follower->on_new_link();
  ptp::EmitPeerDelay first = ask(at + kSecond / 16, kDelay + 700);
  first.first = true;
  hand_over(first);
  EXPECT_NE(logged().find("another link; starting anew"), std::string::npos);
  for (int i = 0; i < 20; ++i) {
    cycle(kDelay + 700);
    EXPECT_NEAR(error_ns(), 0.0, 150.0) << i;
  }
}

TEST_F(NeighbourIsTransmitter, the_same_link_after_a_fault_goes_on) {
  for (int i = 0; i < 100; ++i) noisy_cycle(i);
  follower->on_new_link();
  ptp::EmitPeerDelay first = ask(at + kSecond / 16, kDelay, 0, {100, 50});
  first.first = true;
  hand_over(first);
  for (int i = 0; i < 5; ++i) noisy_cycle(i);
  EXPECT_EQ(logged(), "");
  EXPECT_EQ(used(), 105U);
}

TEST_F(NeighbourIsTransmitter, a_transmitter_that_was_silent_for_a_while_goes_on) {
  for (int i = 0; i < 100; ++i) cycle(kDelay);
  for (int i = 0; i < 10; ++i) {  // nobody is followed; the neighbour answers
    at += kSecond;
    link_delay(kDelay);
  }
  const std::uint64_t before = heard();
  sync(kDelay);
  for (int i = 0; i < 10; ++i) cycle(kDelay);
  EXPECT_EQ(heard() - before, 2 * 10U);
  EXPECT_EQ(logged(), "");
}

TEST_F(NeighbourIsTransmitter, another_reference_is_compared_anew) {
  for (int i = 0; i < 50; ++i) cycle(kDelay);
  follower->on_new_reference();
  const std::uint64_t before = heard();
  for (int i = 0; i < 5; ++i) cycle(kDelay);
  EXPECT_EQ(heard(), before);
  for (int i = 0; i < 50; ++i) cycle(kDelay);
  EXPECT_NEAR(error_ns(), 0.0, 1.0);
  EXPECT_EQ(heard() - before, 2 * 50U);
}

TEST_F(NeighbourIsTransmitter, without_syncs_they_do_not_count_for_long) {
  for (int i = 0; i < 50; ++i) cycle(kDelay);
  const std::uint64_t before = heard();
  for (int i = 0; i < 100; ++i) hand_over(ask(at += kSecond, kDelay));
  EXPECT_LT(heard() - before, 2 * 16U);
}

TEST_F(NeighbourIsTransmitter, a_filter_that_was_chosen_or_another_servo_is_not_gone_round) {
  const auto heard_after = [this] {
    follower.emplace(options, log, clock, source.now(), false, "test");
    for (int i = 0; i < 50; ++i) cycle(kDelay);
    return heard();
  };
  EXPECT_GT(heard_after(), 80U);
  options.follower.filter_is_chosen = true;
  EXPECT_EQ(heard_after(), 0U);
  options.follower.filter_is_chosen = false;
  options.follower.servo.kind = ServoKind::kFtcs;
  EXPECT_EQ(heard_after(), 0U);
}

TEST_F(PeerToPeerFollower, what_waits_for_the_link_delay_goes_with_its_reference) {
  sync(kDelay);
  follower->on_new_reference();
  link_delay(kDelay);
  EXPECT_EQ(used(), 0U);
}

}  // namespace
}  // namespace ftcs::daemon
