// SPDX-License-Identifier: MIT
// Worlds that a design on paper forgets: what a servo says to a register there.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "addend_node.h"

namespace ftcs::addend_test {
namespace {

// The correction was over before it began: what it should have removed is removed by the next one.
TEST(AddendWorlds, a_register_written_a_whole_interval_late_makes_the_next_sample_stale) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  node.step(plant);
  ftcs_addend_sample sample = plant.sample(kLatency);
  ftcs_addend_command late = ftcs_addend_update(&node.servo, &sample);
  plant.next();
  ftcs_addend_sample meanwhile = plant.sample(kLatency);  // stamped, then the register is written
  late.until_ns = std::max(late.until_ns, meanwhile.now_ns);
  plant.obey(late, meanwhile.now_ns);
  ftcs_addend_wrote(&node.servo, meanwhile.now_ns, late.addend, late.next_addend);
  EXPECT_EQ(ftcs_addend_update(&node.servo, &meanwhile).verdict, FTCS_ADDEND_STALE);
  plant.next();
  EXPECT_EQ(node.step(plant).verdict, FTCS_ADDEND_USED);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0);
}

TEST(AddendWorlds, a_sync_interval_that_changes_costs_no_more_than_two_samples) {
  for (const auto& [before, after] :
       {std::pair{1'000'000'000, 31'250'000}, std::pair{31'250'000, 1'000'000'000},
        std::pair{125'000'000, 250'000'000}}) {
    for (const bool quiet : {false, true}) {
      Plant plant(before, 50'000.0, 1'000'000, 0.0);
      Node node(quiet ? ftcs_addend_quiet_config(Plant::kNominal) : plain());
      node.run(plant, 100);
      plant.set_interval_ns(after);
      for (int n = 0; n < 50; ++n) {
        node.step(plant);
        if (n >= 2) {
          EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0)
              << before << " ns to " << after << " ns, sample " << n;
        }
      }
    }
  }
}

TEST(AddendWorlds, an_addend_near_the_end_of_its_register_locks_as_any) {
  const std::uint32_t nominal = 0xFFFFFFFFU - 0x00100000U;  // 244 ppm are left
  Plant plant(kInterval, 50'000.0, 20'000, 0.0, 0, nominal);
  Node node(ftcs_addend_default_config(nominal));
  EXPECT_EQ(node.config.limit_ppm, 244U);
  node.run(plant, 20);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 60.0);
}

// 15 ppm for each unit: half of one is 1 us in an interval.
TEST(AddendWorlds, an_addend_of_sixteen_bits_stays_within_what_its_unit_makes_in_an_interval) {
  const std::uint32_t nominal = 1U << 16U;
  Plant plant(kInterval, 53'000.0, 100'000, 0.0, 0, nominal);
  ftcs_addend_config config = ftcs_addend_default_config(nominal);
  config.gain_q16 = 65'536;
  Node node(config);
  node.run(plant, 5);
  for (int n = 0; n < 200; ++n) {
    node.step(plant);
    EXPECT_LT(std::abs(plant.true_offset_ns()), 2.0 * 125e6 / nominal);
  }
}

// Nanoseconds in 64 bits end in 2262, with an epoch of 1970.
TEST(AddendWorlds, the_end_of_64_bits_costs_one_sample) {
  ftcs_addend_config config = plain();
  ftcs_addend_servo servo;
  ASSERT_EQ(ftcs_addend_init(&servo, &config, Plant::kNominal), FTCS_ADDEND_OK);
  std::uint64_t now = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) -
                      5 * static_cast<std::uint64_t>(kInterval);
  int lost = 0;
  for (int n = 0; n < 20; ++n) {
    now += kInterval;
    const ftcs_addend_sample sample{static_cast<std::int64_t>(now),
                                    static_cast<std::int64_t>(now),
                                    static_cast<std::int64_t>(now + kLatency),
                                    0,
                                    0,
                                    0};
    const ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
    EXPECT_EQ(command.next_addend, Plant::kNominal) << n;
    if (n > 0 && command.act == 0) ++lost;
  }
  EXPECT_LE(lost, 1);
}

// A MAC whose seconds have 32 bits starts again from zero in 2106: a step by 136 years.
TEST(AddendWorlds, seconds_of_32_bits_that_wrap_are_a_jump_that_is_stepped_away) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  ftcs_addend_config config = plain();
  config.step_ns = 100'000'000;
  Node node(config);
  node.run(plant, 10);
  const std::int64_t wrap = -4'294'967'296'000'000'000;
  plant.clock().step(plant.event() - kFineNs, Fine{wrap} * kFineNs);
  EXPECT_EQ(node.step(plant).verdict, FTCS_ADDEND_IMPLAUSIBLE);
  EXPECT_EQ(node.step(plant).step_ns != 0, true);
  node.run(plant, 2);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 100.0);
}

// The driver's alarm of the last correction fires although its addend has been replaced.
TEST(AddendWorlds, an_alarm_that_was_not_cancelled_costs_an_offset_and_nothing_after_it) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 35.0);
  Node node(plain());
  node.run(plant, 10);
  const ftcs_addend_sample sample = plant.sample(kLatency);
  const ftcs_addend_command command = ftcs_addend_update(&node.servo, &sample);
  ftcs_addend_command wrong = command;
  wrong.addend = command.next_addend;  // the alarm writes W at once over C
  plant.obey(wrong, sample.now_ns);
  plant.next();
  node.run(plant, 3);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0);
}

}  // namespace
}  // namespace ftcs::addend_test
