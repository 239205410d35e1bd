// SPDX-License-Identifier: MIT
#include "ftcs/ptp/counters.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace ftcs::ptp {
namespace {

TEST(Counters, names_are_stable_and_distinct) {
  EXPECT_EQ(to_string(Counter::kAnnounceReceived), "announce_received");
  EXPECT_EQ(to_string(Counter::kWrongDomain), "wrong_domain");
  EXPECT_EQ(to_string(Counter::kMissingTransmitStamp), "missing_transmit_stamp");
  EXPECT_EQ(to_string(Counter::kActionsDropped), "actions_dropped");
  std::set<std::string> names;
  for (std::size_t i = 0; i < kCounters; ++i) {
    names.insert(std::string{to_string(static_cast<Counter>(i))});
  }
  EXPECT_EQ(names.size(), kCounters);
  EXPECT_FALSE(names.contains(""));
}

TEST(Counters, each_reason_of_the_decoder_has_a_counter_of_its_name) {
  for (std::size_t i = 0; i < kDecodeReasons; ++i) {
    const auto reason = static_cast<DecodeReason>(i);
    EXPECT_EQ(to_string(counter_of(reason)), to_string(reason));
  }
}

TEST(Counters, add_and_read) {
  Counters counters;
  counters.add(Counter::kMissedSync, 3);
  counters.add(Counter::kMissedSync);
  EXPECT_EQ(counters[Counter::kMissedSync], 4U);
  EXPECT_EQ(counters[Counter::kStaleSync], 0U);
}

}  // namespace
}  // namespace ftcs::ptp
