// SPDX-License-Identifier: MIT
// World: Delay_Req-like messages of 44 octets that differ in their sequence id; a looped packet is
// 42 octets of lower headers and the message.
#include "ftcs/platform/transmission_log.h"

#include <chrono>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr Duration kTimeout{std::chrono::milliseconds{10}};

Bytes message(std::uint8_t sequence) {
  Bytes bytes(44, 0);
  bytes[0] = 1;
  bytes[1] = 2;
  bytes[31] = sequence;
  return bytes;
}

Bytes looped(Bytes bytes) {
  bytes.insert(bytes.begin(), 42, 0xEE);
  return bytes;
}

FreeRunningTime at_ms(std::int64_t ms) { return FreeRunningTime::from_ns(ms * 1'000'000); }

TEST(TransmissionLog, gives_each_stamp_to_its_own_message_whatever_the_order) {
  TransmissionLog log;
  log.remember(message(1), at_ms(0));
  log.remember(message(2), at_ms(1));
  const auto second = log.match(looped(message(2)));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->bytes[31], 2);
  const auto first = log.match(looped(message(1)));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->bytes[31], 1);
  EXPECT_FALSE(log.match(looped(message(1))));
}

TEST(TransmissionLog, takes_a_late_stamp_for_its_own_message_and_not_for_the_next) {
  TransmissionLog log;
  log.remember(message(1), at_ms(0));
  ASSERT_TRUE(log.expire(at_ms(10), kTimeout));
  log.remember(message(2), at_ms(11));
  const auto late = log.match(looped(message(1)));
  ASSERT_TRUE(late);
  EXPECT_TRUE(late->was_expired);
  EXPECT_EQ(late->bytes[31], 1);
  const auto next = log.match(looped(message(2)));
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->was_expired);
}

TEST(TransmissionLog, reports_each_overdue_message_once) {
  TransmissionLog log;
  log.remember(message(1), at_ms(0));
  EXPECT_EQ(log.oldest(), at_ms(0));
  EXPECT_FALSE(log.expire(at_ms(9), kTimeout));
  EXPECT_TRUE(log.expire(at_ms(10), kTimeout));
  EXPECT_FALSE(log.expire(at_ms(11), kTimeout));
  EXPECT_FALSE(log.oldest());
}

TEST(TransmissionLog, matches_a_message_whose_correction_the_adapter_has_filled_in) {
  TransmissionLog log;
  log.remember(message(7), at_ms(0));
  Bytes packet = looped(message(7));
  for (std::size_t i = 8; i < 16; ++i) packet[42 + i] = 0xAB;
  for (std::size_t i = 34; i < 44; ++i) packet[42 + i] = 0xCD;
  EXPECT_TRUE(log.match(packet));
}

TEST(TransmissionLog, survives_short_packets_oversized_messages_and_overflow) {
  TransmissionLog log;
  EXPECT_FALSE(log.match({}));
  log.remember(Bytes(1000, 1), at_ms(0));
  EXPECT_FALSE(log.oldest());
  for (int i = 0; i < 100; ++i) log.remember(message(static_cast<std::uint8_t>(i)), at_ms(i));
  EXPECT_FALSE(log.match(looped(message(10))));
  EXPECT_TRUE(log.match(looped(message(99))));
}

}  // namespace
}  // namespace ftcs::platform
