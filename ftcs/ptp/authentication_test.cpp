// SPDX-License-Identifier: MIT
//
// The world: ports that share keys, and others that do not, or send copies. The code is a sum of
// the octets that is no protection at all, but differs when an octet does: the real ones are tested
// where they are computed (platform, daemon).
#include "ftcs/ptp/wire/authentication.h"

#include <array>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ptp/security_association.h"
#include "ftcs/ptp/time_transmitter.h"
#include "test/support/receiver_fixture.h"
#include "test/support/sum_code.h"

namespace ftcs::ptp {
namespace {
using namespace receiver_test;

/// Association 1 with key 1, of 16 octets, and key 2, of 32.
struct Keys {
  SumCode first{1};
  SumCode second{2};
  SecurityAssociation association{};
  Keys() {
    association.spp = 1;
    association.active_key_id = 1;
    association.add({1, 16, &first});
    association.add({2, 32, &second});
  }
};

MessageBytes sealed(const SecurityAssociation& association, const Message& message) {
  MessageBytes bytes = bytes_of(message);
  EXPECT_TRUE(seal(association, bytes));
  return bytes;
}

TEST(AuthenticationTlv, stands_behind_the_message_and_is_counted_in_its_length) {
  const Keys keys;
  const MessageBytes plain = bytes_of(sync_from(kA, 7));
  const MessageBytes bytes = sealed(keys.association, sync_from(kA, 7));
  ASSERT_EQ(bytes.size, plain.size + kAuthenticationHeaderSize + 16);
  const std::vector<std::uint8_t> expected{0x80, 0x09, 0, 22, 1, 0, 0, 0, 0, 1};
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), bytes.octets.begin() + plain.size));
  EXPECT_EQ(bytes.octets[3], bytes.size);
  EXPECT_TRUE(decode(bytes.view()).ok());
  const auto tlv = find_authentication(bytes.view());
  ASSERT_TRUE(tlv.ok());
  EXPECT_EQ(tlv->spp, 1);
  EXPECT_EQ(tlv->key_id, 1U);
  EXPECT_EQ(tlv->covered, 54U);
  EXPECT_EQ(tlv->code_octets, 16U);
}

TEST(AuthenticationTlv, fits_behind_the_longest_message) {
  Keys keys;
  keys.association.active_key_id = 2;
  FollowUp follow_up;
  follow_up.has_information = true;
  Announce announce;
  announce.path_trace = true;
  for (const Body& body : {Body{follow_up}, Body{announce}}) {
    const MessageBytes bytes = sealed(keys.association, message_from(kA, 1, body));
    EXPECT_EQ(bytes.size, 118);
    EXPECT_EQ(authenticate(keys.association, bytes.view()), Authenticity::kAuthentic);
  }
}

TEST(AuthenticationTlv, is_found_nowhere_but_at_the_end) {
  const Keys keys;
  const auto fault = [](std::span<const std::uint8_t> octets) {
    const auto tlv = find_authentication(octets);
    return tlv ? std::optional<AuthenticationFault>{} : tlv.error();
  };
  const MessageBytes plain = bytes_of(announce_from(kA));
  EXPECT_EQ(fault(plain.view()), AuthenticationFault::kMissing);
  EXPECT_EQ(fault({}), AuthenticationFault::kMissing);
  const MessageBytes good = sealed(keys.association, announce_from(kA));
  for (std::size_t size = 0; size < good.size; ++size) {
    EXPECT_EQ(fault(good.view().first(size)), AuthenticationFault::kMissing) << size;
  }
  std::vector<std::uint8_t> octets(good.view().begin(), good.view().end());
  const auto with = [&octets](std::size_t place, std::uint8_t value) {
    auto changed = octets;
    changed[place] = value;
    return changed;
  };
  EXPECT_EQ(fault(with(64, 0x00)), AuthenticationFault::kMissing);
  EXPECT_EQ(fault(with(69, 0x01)), AuthenticationFault::kUnsupported);  // RES
  EXPECT_EQ(fault(with(69, 0x04)), AuthenticationFault::kUnsupported);  // disclosedKey
  auto more = octets;                                                   // another TLV behind it
  more.insert(more.end(), {0x00, 0x03, 0x00, 0x00});
  more[3] = static_cast<std::uint8_t>(more[3] + 4);
  EXPECT_EQ(fault(more), AuthenticationFault::kMissing);
  auto ragged = octets;
  ragged.insert(ragged.end(), {0x00, 0x00});
  ragged[3] = static_cast<std::uint8_t>(ragged[3] + 2);
  EXPECT_EQ(fault(ragged), AuthenticationFault::kUnsupported);
  auto empty = octets;  // no ICV
  empty.resize(74);
  empty[3] = 74;
  empty[67] = 6;
  EXPECT_EQ(fault(empty), AuthenticationFault::kUnsupported);
}

TEST(Authentication, believes_no_other_key_association_length_or_octet) {
  const Keys keys;
  Keys others;
  MessageBytes bytes = sealed(keys.association, sync_from(kA, 7));
  EXPECT_EQ(authenticate(keys.association, bytes.view()), Authenticity::kAuthentic);
  for (std::size_t i = 0; i < bytes.size; ++i) {
    bytes.octets[i] ^= 0x20;
    EXPECT_NE(authenticate(keys.association, bytes.view()), Authenticity::kAuthentic) << i;
    bytes.octets[i] ^= 0x20;
  }
  others.association.keys[0].code = &others.second;
  EXPECT_EQ(authenticate(others.association, bytes.view()), Authenticity::kWrongCode);
  others.association.keys[0].id = 9;
  EXPECT_EQ(authenticate(others.association, bytes.view()), Authenticity::kUnknownKey);
  others.association.keys[0] = {1, 32, &others.first};
  EXPECT_EQ(authenticate(others.association, bytes.view()), Authenticity::kUnsupported);
  others.association.keys[0] = {1, 16, nullptr};
  EXPECT_EQ(authenticate(others.association, bytes.view()), Authenticity::kWrongCode);
  others.association.spp = 2;
  EXPECT_EQ(authenticate(others.association, bytes.view()), Authenticity::kUnknownKey);
}

TEST(Authentication, leaves_the_correction_out_only_where_that_is_allowed) {
  Keys keys;
  MessageBytes strict = sealed(keys.association, sync_from(kA, 7));
  strict.octets[12] = 1;  // a transparent clock
  EXPECT_EQ(authenticate(keys.association, strict.view()), Authenticity::kWrongCode);
  keys.association.allow_mutable = true;
  MessageBytes loose = sealed(keys.association, sync_from(kA, 7));
  loose.octets[12] = 1;
  EXPECT_EQ(authenticate(keys.association, loose.view()), Authenticity::kAuthentic);
  loose.octets[17] ^= 1;
  EXPECT_EQ(authenticate(keys.association, loose.view()), Authenticity::kWrongCode);
}

TEST(Authentication, seals_nothing_without_its_active_key) {
  Keys keys;
  MessageBytes bytes = bytes_of(sync_from(kA, 7));
  keys.association.active_key_id = 3;
  EXPECT_FALSE(seal(keys.association, bytes));
  keys.association.active_key_id = 1;
  keys.first.works = false;
  EXPECT_FALSE(seal(keys.association, bytes));
  EXPECT_EQ(bytes.size, 44);
}

TEST(Authentication, of_a_transmitter_covers_all_that_it_sends_and_answers) {
  Keys keys;
  TimeTransmitterConfig config;
  config.port = kA;
  config.security = &keys.association;
  TimeTransmitter transmitter(config);
  static_cast<void>(transmitter.start(local(0s)));
  const auto sent = of<SendMessage>(transmitter.on_timer(local(0s)));
  ASSERT_EQ(sent.size(), 2U);
  for (const SendMessage& message : sent) {
    EXPECT_EQ(authenticate(keys.association, message.bytes.view()), Authenticity::kAuthentic);
  }
  const Message request = message_from(kUs, 1, DelayReq{});
  EXPECT_TRUE(
      transmitter.on_event_message(bytes_of(request).view(), reference(0s), local(0s)).empty());
  EXPECT_EQ(transmitter.counters()[Counter::kAuthenticationMissing], 1U);
  const auto answers = of<SendMessage>(transmitter.on_event_message(
      sealed(keys.association, request).view(), reference(0s), local(0s)));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(authenticate(keys.association, answers[0].bytes.view()), Authenticity::kAuthentic);
  keys.first.works = false;
  EXPECT_TRUE(of<SendMessage>(transmitter.on_timer(local(10s))).empty());
  EXPECT_GT(transmitter.counters()[Counter::kNotSealed], 0U);
}

/// A receiver with keys.
class AuthenticReceiver : private Keys, public Receiver {
 protected:
  AuthenticReceiver() : Receiver(with(&this->Keys::association)) {}
  static TimeReceiverConfig with(const SecurityAssociation* association) {
    TimeReceiverConfig config = default_config();
    config.security = association;
    return config;
  }
  SecurityAssociation& shared() { return this->Keys::association; }

  ActionList hear_event(const Message& message, Nanoseconds at) {
    return receiver_.on_event_message(sealed(shared(), message).view(), local(at), local(at));
  }
  ActionList hear(const Message& message, Nanoseconds at) {
    return receiver_.on_general_message(sealed(shared(), message).view(), local(at));
  }
  ActionList hear_announce(std::uint16_t sequence_id, Nanoseconds at) {
    Message message = announce_from(kA);
    message.header.sequence_id = sequence_id;
    return hear(message, at);
  }
  /// How many pairs came of a Sync and its Follow_Up.
  std::size_t hear_sync(std::uint16_t sequence_id, Nanoseconds sent, Nanoseconds told) {
    static_cast<void>(hear_event(sync_from(kA, sequence_id), sent + kDelay));
    return of<EmitPair>(hear(follow_up(sequence_id, told), sent + 2 * kDelay)).size();
  }
  std::size_t hear_sync(std::uint16_t sequence_id, Nanoseconds sent) {
    return hear_sync(sequence_id, sent, sent);
  }
  void hear_a() {
    static_cast<void>(hear_announce(100, 0s));
    static_cast<void>(hear_announce(101, 250ms));
    ASSERT_NE(receiver_.transmitter(), nullptr);
  }
};

TEST_F(AuthenticReceiver, follows_who_has_the_keys_and_nobody_else) {
  static_cast<void>(general(announce_from(kB, 1), 0s));
  static_cast<void>(general(announce_from(kB, 1), 100ms));
  EXPECT_EQ(receiver_.transmitter(), nullptr);
  EXPECT_EQ(count(Counter::kAuthenticationMissing), 2U);
  hear_a();
  EXPECT_EQ(hear_sync(1, 300ms), 1U);
  EXPECT_EQ(count(Counter::kAuthenticated), 4U);
}

TEST_F(AuthenticReceiver, asks_with_its_active_key) {
  hear_a();
  const auto sent = of<SendMessage>(hear_event(sync_from(kA, 1), 300ms));
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(sent[0].type, MessageType::kDelayReq);
  EXPECT_EQ(authenticate(shared(), sent[0].bytes.view()), Authenticity::kAuthentic);
}

TEST_F(AuthenticReceiver, accepts_each_of_its_keys_as_they_are_changed) {
  hear_a();
  EXPECT_EQ(hear_sync(1, 300ms), 1U);
  shared().active_key_id = 2;  // the transmitter's
  EXPECT_EQ(hear_sync(2, 425ms), 1U);
  EXPECT_EQ(count(Counter::kAuthenticated), 6U);
}

TEST_F(AuthenticReceiver, uses_no_sync_twice_and_none_beyond_its_window) {
  hear_a();
  for (std::uint16_t id = 10; id < 20; ++id) {
    ASSERT_EQ(hear_sync(id, 300ms + 125ms * (id - 10)), 1U);
  }
  // The last one was 19 at 1425 ms.
  EXPECT_EQ(hear_sync(19, 1430ms), 0U);
  EXPECT_EQ(hear_sync(12, 1440ms), 0U);
  EXPECT_EQ(hear_sync(23, 1450ms), 0U);
  EXPECT_EQ(count(Counter::kReplayed), 6U);
  EXPECT_EQ(hear_sync(22, 1800ms), 1U);  // after the loss of two
}

TEST_F(AuthenticReceiver, begins_anew_after_more_loss_than_its_window_is_wide) {
  hear_a();
  ASSERT_EQ(hear_sync(1, 300ms), 1U);
  EXPECT_EQ(hear_sync(9, 1250ms), 0U);
  EXPECT_EQ(hear_sync(10, 1425ms), 1U);
  EXPECT_EQ(hear_sync(11, 1550ms), 1U);
}

TEST_F(AuthenticReceiver, looks_at_no_number_where_the_window_is_zero) {
  shared().sequence_window = 0;
  hear_a();
  static_cast<void>(hear_announce(101, 260ms));
  ASSERT_EQ(hear_sync(1, 300ms), 1U);
  EXPECT_EQ(hear_sync(9, 425ms), 1U);
  EXPECT_EQ(count(Counter::kReplayed), 0U);
}

TEST_F(AuthenticReceiver, is_not_kept_with_a_silent_transmitter_by_old_announces) {
  hear_a();
  static_cast<void>(hear_announce(102, 1s));
  for (int i = 0; i < 10; ++i) static_cast<void>(hear_announce(101, 1s + i * 500ms));
  EXPECT_EQ(count(Counter::kReplayed), 10U);
  static_cast<void>(receiver_.on_timer(local(6s)));
  EXPECT_EQ(receiver_.transmitter(), nullptr);
}

/// What a transmitter sent to a receiver that had just been started, all of it, is sent once more
/// to the same receiver after its next start.
TEST_F(AuthenticReceiver, started_again_it_takes_no_recorded_answer_for_its_own) {
  std::size_t answered[2] = {};
  std::vector<std::uint16_t> recorded;
  for (const bool again : {false, true}) {
    TimeReceiverConfig config = with(&shared());
    config.first_request_id = again ? 40'000 : 7;
    receiver_ = TimeReceiver(config);
    static_cast<void>(receiver_.start(local(0s)));
    hear_a();
    std::size_t asked = 0;
    for (std::uint16_t id = 0; id < 100; ++id) {
      const Nanoseconds at = 300ms + 125ms * id;
      if (id % 4 == 0) {
        static_cast<void>(hear_announce(static_cast<std::uint16_t>(102 + id / 4), at));
      }
      EXPECT_EQ(hear_sync(id, at), 1U) << "it is authentic, and new to who has just begun";
      const Nanoseconds left = at + 50ms;
      for (const SendMessage& ask : of<SendMessage>(receiver_.on_timer(local(left)))) {
        static_cast<void>(receiver_.on_transmit_timestamp(ask.id(), local(left), local(left)));
        if (!again) recorded.push_back(ask.sequence_id);
        const Message answer =
            message_from(kA, recorded.at(asked++), DelayResp{reference(left + kDelay), kUs});
        answered[again ? 1 : 0] += of<EmitPair>(hear(answer, left + 2 * kDelay)).size();
      }
    }
  }
  EXPECT_GT(answered[0], 5U);
  EXPECT_EQ(answered[1], 0U);
}

// Recorded before the transmitter was started again, or half a round of the numbers ago.
TEST_F(AuthenticReceiver, does_not_lose_its_transmitter_to_one_old_announce) {
  hear_a();
  static_cast<void>(hear_announce(20'000, 300ms));
  EXPECT_EQ(count(Counter::kReplayed), 1U);
  for (std::uint16_t id = 102; id < 110; ++id) {
    const Nanoseconds at = 1s * (id - 101);
    static_cast<void>(hear_announce(id, at));
    static_cast<void>(receiver_.on_timer(local(at)));
    ASSERT_NE(receiver_.transmitter(), nullptr) << id;
  }
}

TEST_F(AuthenticReceiver, selects_no_transmitter_by_copies_of_one_announce) {
  hear_a();
  Message better = announce_from(kB, 1);
  better.header.sequence_id = 7;
  for (int i = 0; i < 5; ++i) static_cast<void>(hear(better, 300ms + i * 100ms));
  EXPECT_EQ(count(Counter::kReplayed), 4U);
  EXPECT_EQ(receiver_.transmitter()->port, kA);
  better.header.sequence_id = 8;
  static_cast<void>(hear(better, 1s));
  EXPECT_EQ(receiver_.transmitter()->port, kB);
}

TEST_F(AuthenticReceiver, hears_another_transmitter_that_was_started_again_after_its_timeout) {
  hear_a();
  Message other = announce_from(kB, 200);
  other.header.sequence_id = 500;
  static_cast<void>(hear(other, 300ms));
  other.header.sequence_id = 0;
  static_cast<void>(hear(other, 3200ms));
  EXPECT_EQ(count(Counter::kReplayed), 1U);
  static_cast<void>(hear(other, 3300ms));
  EXPECT_EQ(count(Counter::kReplayed), 1U);
}

TEST_F(AuthenticReceiver, hears_an_announce_again_after_as_many_were_lost_as_may_be) {
  hear_a();
  static_cast<void>(hear_announce(104, 3s));
  static_cast<void>(receiver_.on_timer(local(4s)));
  EXPECT_EQ(count(Counter::kReplayed), 0U);
  EXPECT_NE(receiver_.transmitter(), nullptr);
}

TEST_F(AuthenticReceiver, follows_a_transmitter_that_was_started_again) {
  hear_a();
  ASSERT_EQ(hear_sync(5000, 300ms), 1U);
  // Its numbers begin at 0. Its Announces are old ones until it has been lost.
  std::size_t pairs = 0;
  for (int i = 0; i < 160; ++i) {
    const Nanoseconds at = 2s + i * 125ms;
    if (i % 8 == 0) static_cast<void>(hear_announce(static_cast<std::uint16_t>(i / 8), at));
    static_cast<void>(receiver_.on_timer(local(at)));
    pairs += hear_sync(static_cast<std::uint16_t>(i), at);
  }
  EXPECT_GT(pairs, 100U);
  ASSERT_NE(receiver_.transmitter(), nullptr);
}

}  // namespace
}  // namespace ftcs::ptp
