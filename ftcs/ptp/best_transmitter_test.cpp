// SPDX-License-Identifier: MIT
//
// The world: transmitters that announce themselves once a second to a receiver's table. Expected
// orders are read off the standard's flow chart (IEEE 1588-2019, 9.3.4), not computed by the code
// under test.
#include "ftcs/ptp/best_transmitter.h"

#include <vector>

#include <gtest/gtest.h>

namespace ftcs::ptp {
namespace {
using namespace std::chrono_literals;

PortIdentity port(std::uint8_t last) { return {ClockIdentity::from_mac({2, 0, 0, 0, 0, last}), 1}; }

TransmitterData transmitter(std::uint8_t last) {
  TransmitterData data;
  data.port = port(last);
  data.announce.grandmaster = data.port.clock;
  return data;
}

FreeRunningTime at(Nanoseconds time) { return FreeRunningTime{Duration{time}}; }

TEST(DataSetComparison, properties_decide_in_the_order_of_the_standard) {
  // Each one is better than the next: the property named decides although all later ones speak
  // against it.
  std::vector<TransmitterData> ranking(7, transmitter(9));
  const auto set = [](TransmitterData& data, std::uint8_t priority1, ClockQuality quality,
                      std::uint8_t priority2, std::uint8_t identity) {
    data = transmitter(identity);
    data.announce.priority1 = priority1;
    data.announce.quality = quality;
    data.announce.priority2 = priority2;
  };
  set(ranking[0], 1, {255, 255, 65535}, 255, 9);  // priority1
  set(ranking[1], 2, {6, 255, 65535}, 255, 8);    // clockClass
  set(ranking[2], 2, {7, 0x20, 65535}, 255, 7);   // clockAccuracy
  set(ranking[3], 2, {7, 0x21, 100}, 255, 6);     // offsetScaledLogVariance
  set(ranking[4], 2, {7, 0x21, 200}, 1, 5);       // priority2
  set(ranking[5], 2, {7, 0x21, 200}, 2, 3);       // identity
  set(ranking[6], 2, {7, 0x21, 200}, 2, 4);
  for (std::size_t a = 0; a < ranking.size(); ++a) {
    for (std::size_t b = 0; b < ranking.size(); ++b) {
      EXPECT_EQ(better(ranking[a], ranking[b]), a < b) << a << " against " << b;
    }
  }
}

TEST(DataSetComparison, of_two_paths_to_one_grandmaster_the_shorter_wins_then_the_smaller_sender) {
  auto near = transmitter(8);
  auto far = transmitter(2);
  far.announce.grandmaster = near.announce.grandmaster;
  far.announce.steps_removed = 1;
  far.announce.priority1 = 1;  // one grandmaster: its properties do not count
  EXPECT_TRUE(better(near, far));
  EXPECT_FALSE(better(far, near));
  far.announce.steps_removed = 0;
  EXPECT_TRUE(better(far, near));
  EXPECT_FALSE(better(near, far));
}

class Table : public testing::Test {
 protected:
  [[nodiscard]] const TransmitterData* best(Nanoseconds now, PortIdentity selected = {}) const {
    return table_.best(selected, at(now));
  }
  ForeignTransmitters::Heard hear(const TransmitterData& data, Nanoseconds now) {
    return table_.hear(data, Duration{1s}, at(now));
  }
  ForeignTransmitters table_;
};

TEST_F(Table, one_announce_qualifies_nobody_two_within_four_intervals_do) {
  EXPECT_EQ(hear(transmitter(1), 0s), ForeignTransmitters::Heard::kNew);
  EXPECT_EQ(best(0s), nullptr);
  EXPECT_EQ(hear(transmitter(1), 4s), ForeignTransmitters::Heard::kKnown);
  ASSERT_NE(best(4s), nullptr);
  EXPECT_EQ(best(4s)->port, port(1));
}

TEST_F(Table, two_announces_too_far_apart_qualify_nobody) {
  hear(transmitter(1), 0s);
  hear(transmitter(1), 4s + 1ns);
  EXPECT_EQ(best(4s + 1ns), nullptr);
}

TEST_F(Table, the_selected_one_stays_until_it_is_forgotten) {
  hear(transmitter(1), 0s);
  hear(transmitter(1), 1s);
  EXPECT_EQ(best(60s), nullptr);
  EXPECT_NE(best(60s, port(1)), nullptr);
  table_.forget(port(1));
  EXPECT_EQ(best(60s, port(1)), nullptr);
  EXPECT_FALSE(table_.receipt_timeout(port(1), 3).has_value());
}

TEST_F(Table, the_best_of_the_qualified_is_found) {
  for (const auto last : {std::uint8_t{5}, std::uint8_t{2}, std::uint8_t{7}}) {
    hear(transmitter(last), 0s);
    hear(transmitter(last), 1s);
  }
  hear(transmitter(1), 1s);  // better, but heard once only
  ASSERT_NE(best(1s), nullptr);
  EXPECT_EQ(best(1s)->port, port(2));
}

TEST_F(Table, a_full_table_keeps_whom_it_knows_and_gives_away_the_place_of_the_silent) {
  for (std::uint8_t last = 1; last <= ForeignTransmitters::kCapacity; ++last) {
    EXPECT_EQ(hear(transmitter(last), 0s), ForeignTransmitters::Heard::kNew);
  }
  EXPECT_EQ(hear(transmitter(99), 1s), ForeignTransmitters::Heard::kTableFull);
  for (std::uint8_t last = 2; last <= ForeignTransmitters::kCapacity; ++last) {
    EXPECT_EQ(hear(transmitter(last), 4s), ForeignTransmitters::Heard::kKnown);
  }
  EXPECT_EQ(hear(transmitter(99), 4s), ForeignTransmitters::Heard::kTableFull) << "not yet silent";
  EXPECT_EQ(hear(transmitter(99), 5s), ForeignTransmitters::Heard::kNew) << "1 is silent since 0 s";
  EXPECT_EQ(hear(transmitter(1), 5s), ForeignTransmitters::Heard::kTableFull);
}

TEST_F(Table, silence_is_counted_in_the_transmitters_own_intervals) {
  table_.hear(transmitter(1), Duration{250ms}, at(10s));
  table_.hear(transmitter(2), Duration{4s}, at(11s));
  EXPECT_EQ(table_.receipt_timeout(port(1), 3), at(10s + 750ms));
  EXPECT_EQ(table_.receipt_timeout(port(2), 3), at(23s));
  EXPECT_FALSE(table_.receipt_timeout(port(3), 3).has_value());
}

}  // namespace
}  // namespace ftcs::ptp
