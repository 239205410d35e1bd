// SPDX-License-Identifier: MIT
//
// The world: receiver_fixture.h. Transmitters that come, go, improve and change.
#include <gtest/gtest.h>

#include "test/support/receiver_fixture.h"

namespace ftcs::ptp::receiver_test {
namespace {

TEST_F(Receiver, a_transmitter_that_stops_is_given_up_after_three_of_its_intervals) {
  select_a();
  static_cast<void>(event(sync_from(kA, 0), 300ms));
  static_cast<void>(receiver_.on_timer(local(3249ms)));
  EXPECT_NE(receiver_.transmitter(), nullptr);
  const auto actions = receiver_.on_timer(local(3250ms));  // last Announce at 250 ms
  ASSERT_EQ(of<PortStateChanged>(actions).size(), 1U);
  EXPECT_EQ(of<PortStateChanged>(actions)[0].event, PortEvent::kAnnounceReceiptTimeoutExpires);
  EXPECT_EQ(receiver_.transmitter(), nullptr);
  EXPECT_FALSE(receiver_.deadline().has_value()) << "no request to nobody";
  EXPECT_EQ(count(Counter::kAnnounceTimeouts), 1U);
}

TEST_F(Receiver, a_transmitter_that_returns_is_no_new_reference) {
  select_a();
  static_cast<void>(receiver_.on_timer(local(4s)));
  static_cast<void>(general(announce_from(kA), 10s));
  const auto selected = of<TransmitterSelected>(general(announce_from(kA), 10250ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_FALSE(selected[0].changed);
}

TEST_F(Receiver, a_servo_that_stayed_locked_is_believed_when_the_same_transmitter_returns) {
  select_a();
  static_cast<void>(receiver_.on_servo_locked(local(1s)));
  static_cast<void>(receiver_.on_timer(local(4s)));
  select_a(5s);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
  const auto changes = of<PortStateChanged>(exchange(1, 6s));
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].event, PortEvent::kTransmitterClockSelected);
  EXPECT_EQ(receiver_.state(), PortState::kTimeReceiver);
}

TEST_F(Receiver, a_servo_that_lost_lock_is_not_believed) {
  select_a();
  static_cast<void>(receiver_.on_servo_locked(local(1s)));
  static_cast<void>(receiver_.on_servo_unlocked(local(1s)));
  static_cast<void>(exchange(1, 2s));
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
}

TEST_F(Receiver, a_lock_to_one_reference_says_nothing_about_another) {
  select_a();
  static_cast<void>(receiver_.on_servo_locked(local(1s)));
  static_cast<void>(general(announce_from(kB, 1), 1s));
  static_cast<void>(general(announce_from(kB, 1), 2s));
  ASSERT_EQ(receiver_.transmitter()->port, kB);
  Message sync = message_from(kB, 1, Sync{reference(2s)});
  EXPECT_EQ(of<EmitPair>(event(sync, 2s)).size(), 1U);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
}

TEST_F(Receiver, a_better_transmitter_takes_over_and_open_exchanges_do_not_mix) {
  select_a();
  static_cast<void>(receiver_.on_servo_locked(local(300ms)));
  static_cast<void>(event(sync_from(kA, 1), 300ms));
  static_cast<void>(general(announce_from(kB, 1), 400ms));
  const auto actions = general(announce_from(kB, 1), 650ms);
  const auto selected = of<TransmitterSelected>(actions);
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_EQ(selected[0].transmitter.port, kB);
  EXPECT_TRUE(selected[0].changed);
  ASSERT_EQ(of<PortStateChanged>(actions).size(), 1U);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
  EXPECT_EQ(count(Counter::kTransmitterChanges), 1U) << "the first one is no change";
  EXPECT_TRUE(general(message_from(kB, 1, FollowUp{reference(300ms)}), 660ms).empty())
      << "B's Follow_Up must not meet A's Sync of the same id";
  EXPECT_TRUE(of<EmitPair>(general(follow_up(1, 300ms), 660ms)).empty());
}

TEST_F(Receiver, a_transmitter_that_changes_its_identity_is_followed_under_the_new_one) {
  select_a();
  for (Nanoseconds at = 500ms; at <= 2500ms; at += 1s) {
    static_cast<void>(general(announce_from(kB), at));
  }
  EXPECT_EQ(receiver_.transmitter()->port, kA) << "A is better by identity and not yet silent";
  const auto actions = receiver_.on_timer(local(3250ms));
  ASSERT_EQ(of<TransmitterSelected>(actions).size(), 1U);
  EXPECT_TRUE(of<TransmitterSelected>(actions)[0].changed);
  EXPECT_EQ(receiver_.transmitter()->port, kB);
  EXPECT_EQ(receiver_.state(), PortState::kUncalibrated);
}

TEST_F(Receiver, a_new_grandmaster_behind_the_same_port_is_another_reference) {
  select_a();
  Message announce = announce_from(kA);
  std::get<Announce>(announce.body).utc_offset = 38;
  auto selected = of<TransmitterSelected>(general(announce, 500ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_FALSE(selected[0].changed) << "only what it says has changed";
  std::get<Announce>(announce.body).grandmaster = kB.clock;
  selected = of<TransmitterSelected>(general(announce, 750ms));
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_TRUE(selected[0].changed);
}

TEST_F(Receiver, announces_that_went_too_far_or_claim_our_identity_are_refused) {
  Message announce = announce_from(kA);
  std::get<Announce>(announce.body).steps_removed = 255;
  EXPECT_TRUE(general(announce, 0s).empty());
  std::get<Announce>(announce.body) = Announce{};
  std::get<Announce>(announce.body).grandmaster = kUs.clock;
  EXPECT_TRUE(general(announce, 0s).empty());
  EXPECT_TRUE(general(announce_from({kUs.clock, 2}), 0s).empty());
  EXPECT_EQ(count(Counter::kUnusableAnnounce), 3U);
}

TEST_F(Receiver, a_flood_of_identities_does_not_push_the_selected_one_out) {
  select_a();
  for (std::uint16_t port = 2; port < 1000; ++port) {
    static_cast<void>(general(announce_from({kB.clock, port}), 300ms));
  }
  EXPECT_EQ(receiver_.transmitter()->port, kA);
  EXPECT_EQ(count(Counter::kForeignTableFull), 998U - 7U);
}

class PatientReceiver : public Receiver {
 protected:
  static TimeReceiverConfig patient() {
    TimeReceiverConfig config = default_config();
    config.announce_receipt_timeout = 10;
    return config;
  }
  PatientReceiver() : Receiver(patient()) {}
};

TEST_F(PatientReceiver, a_newcomer_does_not_take_the_place_of_a_silent_one_that_still_has_time) {
  select_a();
  static_cast<void>(general(announce_from(kB), 6s));  // A: silent for longer than it qualifies
  EXPECT_EQ(receiver_.deadline(), local(10250ms));
  static_cast<void>(receiver_.on_timer(local(10250ms)));
  EXPECT_EQ(receiver_.transmitter(), nullptr) << "A is given up all the same";
}

TEST_F(Receiver, an_announce_interval_out_of_range_counts_as_the_configured_one) {
  Message announce = announce_from(kA);
  announce.header.log_interval = 100;
  static_cast<void>(general(announce, 0s));
  static_cast<void>(general(announce, 1s));
  EXPECT_EQ(count(Counter::kBadInterval), 2U);
  EXPECT_EQ(receiver_.deadline(), local(1s + 3 * 2s));
}

// Two frames, then silence: 385 s without a transmitter.
TEST_F(Receiver, who_promises_the_next_announce_in_minutes_is_given_up_in_seconds) {
  select_a();
  Message rogue = announce_from(kB, 0);
  rogue.header.log_interval = 7;
  static_cast<void>(general(rogue, 1s));
  static_cast<void>(general(rogue, 1100ms));
  ASSERT_EQ(receiver_.transmitter()->port, kB);
  static_cast<void>(general(announce_from(kA), 5s));
  static_cast<void>(general(announce_from(kA), 6s));
  static_cast<void>(receiver_.on_timer(local(7'200ms)));
  ASSERT_NE(receiver_.transmitter(), nullptr);
  EXPECT_EQ(receiver_.transmitter()->port, kA) << "three of our own intervals of two seconds";
}

TEST_F(Receiver, one_forged_announce_does_not_hide_that_the_transmitter_is_gone) {
  select_a();
  Message forged = announce_from(kA);
  forged.header.log_interval = 7;
  static_cast<void>(general(forged, 1s));
  static_cast<void>(receiver_.on_timer(local(7'100ms)));
  EXPECT_EQ(receiver_.transmitter(), nullptr);
}

TEST_F(Receiver, a_transmitter_that_announces_slower_than_we_would_is_kept) {
  Message slow = announce_from(kA);
  slow.header.log_interval = 4;
  for (int i = 0; i < 20; ++i) {
    if (const auto due = receiver_.deadline(); due && *due <= local(i * 16s)) {
      static_cast<void>(receiver_.on_timer(local(i * 16s)));
    }
    static_cast<void>(general(slow, i * 16s));
    EXPECT_EQ(receiver_.transmitter() != nullptr, i > 0) << i;
  }
}

TEST_F(Receiver, identities_that_no_clock_has_are_not_followed) {
  const ClockIdentity nobody{};
  const ClockIdentity everybody{{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}};
  for (const PortIdentity& odd : {PortIdentity{nobody, 1}, PortIdentity{everybody, 1},
                                  PortIdentity{kA.clock, 0}, PortIdentity{kA.clock, 0xFFFF}}) {
    EXPECT_TRUE(general(announce_from(odd), 0s).empty());
    EXPECT_TRUE(general(announce_from(odd), 250ms).empty());
  }
  Message of_nobody = announce_from(kA);
  std::get_if<Announce>(&of_nobody.body)->grandmaster = nobody;
  EXPECT_TRUE(general(of_nobody, 500ms).empty());
  EXPECT_EQ(count(Counter::kUnusableAnnounce), 9U);
}

// The better one told a time that was refused: any other is preferred, and while there is none, it
// stays.
TEST_F(Receiver, a_doubted_transmitter_makes_room_for_any_other_and_is_forgiven_in_time) {
  select_a();
  EXPECT_EQ(of<TransmitterDoubted>(receiver_.on_transmitter_doubted(local(1s))).size(), 1U);
  EXPECT_EQ(receiver_.transmitter()->port, kA) << "there is no other";
  static_cast<void>(general(announce_from(kB, 200), 1s));
  static_cast<void>(general(announce_from(kB, 200), 2s));
  EXPECT_EQ(receiver_.transmitter()->port, kB) << "worse, and not doubted";
  for (Nanoseconds at = 3s; at < 300s; at += 1s) {
    static_cast<void>(general(announce_from(kA), at));
    static_cast<void>(general(announce_from(kB, 200), at));
    ASSERT_EQ(receiver_.transmitter()->port, kB);
  }
  static_cast<void>(general(announce_from(kA), 302s));
  EXPECT_EQ(receiver_.transmitter()->port, kA);
  EXPECT_EQ(count(Counter::kDoubtedTransmitters), 1U);
}

}  // namespace
}  // namespace ftcs::ptp::receiver_test
