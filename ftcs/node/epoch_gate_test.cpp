// SPDX-License-Identifier: MIT
// World: a machine whose system clock shows 2026-11-22, a program built the day before, and a
// reference in TAI.
#include "ftcs/node/epoch_gate.h"

#include <gtest/gtest.h>

namespace ftcs::node {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kNow = 1'795'305'600;
constexpr std::int64_t kDay = 86'400;

class EpochGateTest : public testing::Test {
 protected:
  EpochGateTest() { rules.earliest_utc_s = kNow - kDay; }
  /// The reference, in UTC and relative to kNow; the system clock likewise.
  EpochVerdict read(EpochGate& gate, std::int64_t reference_ns, std::int64_t machine_ns,
                    std::int64_t system_ns = 0) {
    const auto reference = ReferenceTime::from_ns((kNow + 37) * kSecond + reference_ns);
    return gate.judge(reference, Duration::from_whole_ns(37 * kSecond),
                      {kNow * kSecond + system_ns, FreeRunningTime::from_ns(machine_ns)});
  }
  EpochRules rules;
};

TEST_F(EpochGateTest, a_date_before_the_program_was_built_is_refused) {
  EpochGate gate(rules);
  EXPECT_EQ(read(gate, -kNow * kSecond, 0), EpochVerdict::kTooEarly);
  EXPECT_NEAR(gate.excess().seconds(), -static_cast<double>(kNow), 1.0);
  EXPECT_EQ(read(gate, -(kDay + 1) * kSecond, 0), EpochVerdict::kTooEarly);
  EXPECT_FALSE(gate.has_begun());
  EXPECT_EQ(read(gate, 0, 0), EpochVerdict::kPlausible);
  EXPECT_TRUE(gate.has_begun());
}

TEST_F(EpochGateTest, the_first_reading_is_within_a_day_of_the_system_clock) {
  for (const std::int64_t sign : {1, -1}) {
    rules.earliest_utc_s = kNow - 100 * kDay;
    EpochGate gate(rules);
    EXPECT_EQ(read(gate, sign * (kDay * kSecond + 1), 0), EpochVerdict::kFarFromSystem);
    EXPECT_EQ(read(gate, sign * kDay * kSecond, 0), EpochVerdict::kPlausible);
  }
}

TEST_F(EpochGateTest, limits_and_epochs_can_be_opened) {
  rules.largest_first_change = Nanoseconds{0};
  EpochGate far(rules);
  EXPECT_EQ(read(far, 3000 * kDay * kSecond, 0), EpochVerdict::kPlausible);
  rules.any_epoch = true;
  EpochGate any(rules);
  EXPECT_EQ(read(any, -kNow * kSecond, 0), EpochVerdict::kPlausible);
  EXPECT_EQ(read(any, -kNow * kSecond + 5 * kSecond, 0), EpochVerdict::kJumped)
      << "an epoch may be any, but it stays the same";
}

// No battery behind its clock: it starts in 1970, and the reference is what sets it.
TEST_F(EpochGateTest, a_system_clock_that_was_never_set_is_no_witness) {
  EpochGate gate(rules);
  constexpr std::int64_t k1970 = -kNow * kSecond;
  EXPECT_EQ(read(gate, 30 * 365 * kDay * kSecond, 0, k1970), EpochVerdict::kFarFromSystem);
  EXPECT_EQ(read(gate, 5 * kSecond, 0, k1970 + 5 * kSecond), EpochVerdict::kPlausible);
}

TEST_F(EpochGateTest, a_jump_against_the_machines_oscillator_is_refused_until_it_is_undone) {
  for (const std::int64_t sign : {1, -1}) {
    EpochGate gate(rules);
    EXPECT_EQ(read(gate, 0, 0), EpochVerdict::kPlausible);
    EXPECT_EQ(read(gate, kSecond, kSecond), EpochVerdict::kPlausible);
    EXPECT_EQ(read(gate, 2 * kSecond + sign * 1'100'000'000, 2 * kSecond), EpochVerdict::kJumped);
    EXPECT_NEAR(gate.excess().seconds(), 1.1 * static_cast<double>(sign), 1e-9);
    EXPECT_EQ(read(gate, 3 * kSecond + sign * 900'000'000, 3 * kSecond), EpochVerdict::kPlausible);
  }
}

// Replays and rogues that move by less than the limit each time.
TEST_F(EpochGateTest, small_jumps_add_up_to_no_more_than_the_whole_limit) {
  EpochGate gate(rules);
  std::int64_t shift = 0;
  std::int64_t at = 0;
  EpochVerdict verdict = EpochVerdict::kPlausible;
  for (int i = 0; i < 100 && verdict == EpochVerdict::kPlausible; ++i) {
    at += kSecond;
    shift += kSecond / 2;
    verdict = read(gate, at + shift, at);
  }
  EXPECT_EQ(verdict, EpochVerdict::kWandered);
  EXPECT_NEAR(static_cast<double>(shift), 10.5e9, 0.6e9);
}

TEST_F(EpochGateTest, crystals_may_differ_for_months) {
  for (const std::int64_t ppm : {300, -300}) {
    EpochGate gate(rules);
    for (std::int64_t day = 0; day < 300; ++day) {
      const std::int64_t machine = day * kDay * kSecond;
      ASSERT_EQ(read(gate, machine + machine / 1'000'000 * ppm, machine), EpochVerdict::kPlausible)
          << day;
    }
  }
}

}  // namespace
}  // namespace ftcs::node
