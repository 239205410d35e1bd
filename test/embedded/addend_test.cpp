// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "addend_node.h"

namespace ftcs::addend_test {
namespace {

TEST(AddendServo, removes_a_millisecond_and_fifty_ppm_in_one_interval_and_says_that_it_is_locked) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  EXPECT_EQ(node.step(plant).state, FTCS_ADDEND_WAITING);
  EXPECT_EQ(node.step(plant).state, FTCS_ADDEND_ACQUIRING);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 30.0);
  EXPECT_EQ(node.step(plant).state, FTCS_ADDEND_LOCKED);
  EXPECT_NEAR(ftcs_addend_rate_ppb(&node.servo), -50'000, 200);
}

TEST(AddendServo, pulls_an_oscillator_that_is_off_by_one_and_a_half_percent) {
  Plant plant(kInterval, 15e6, 1'000'000, 35.0);
  Node node(plain());
  node.run(plant, 2);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0);
}

TEST(AddendServo,
     leaves_the_offset_that_a_late_write_left_only_until_the_next_sample_if_it_is_told) {
  for (const bool told : {true, false}) {
    Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
    Node node(plain());
    node.step(plant);
    ftcs_addend_sample sample = plant.sample(kLatency);
    const ftcs_addend_command command = ftcs_addend_update(&node.servo, &sample);
    sample.now_ns += 20'000'000;  // the register is written 20 ms after the moment that was planned
    plant.obey(command, sample.now_ns);
    if (told) ftcs_addend_wrote(&node.servo, sample.now_ns, command.addend, command.next_addend);
    plant.next();
    const ftcs_addend_command next = node.step(plant);
    const double error = std::abs(static_cast<double>(next.next_addend) - command.next_addend);
    if (told) {
      EXPECT_LT(error, 500.0);  // 0.4 ppm: ticks of 20 ns over 125 ms
    } else {
      EXPECT_GT(error, 100'000.0);
    }
  }
}

TEST(AddendServo, knows_the_rate_that_a_coarse_actuator_really_made) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  for (int n = 0; n < 20; ++n) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    ftcs_addend_command command = ftcs_addend_update(&node.servo, &sample);
    command.addend = command.addend / 20'000U * 20'000U;  // steps of 16 ppm
    command.next_addend = command.next_addend / 20'000U * 20'000U;
    plant.obey(command, sample.now_ns);
    if (command.act != 0)
      ftcs_addend_wrote(&node.servo, sample.now_ns, command.addend, command.next_addend);
    plant.next();
    if (n <= 3) continue;
    EXPECT_LT(std::abs(plant.true_offset_ns()), 16e-6 * 125e6 * 1.5) << n;
  }
}

TEST(AddendServo, ends_a_correction_late_without_harm_if_it_is_told_when) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  ftcs_addend_config config = plain();
  config.correction_ns = kInterval / 2;
  Node node(config);
  node.step(plant);
  const ftcs_addend_sample sample = plant.sample(kLatency);
  ftcs_addend_command command = ftcs_addend_update(&node.servo, &sample);
  command.until_ns += 10'000'000;
  plant.obey(command, sample.now_ns);
  ftcs_addend_wrote_next(&node.servo, command.until_ns);
  plant.next();
  const ftcs_addend_command next = node.step(plant);
  EXPECT_NEAR(next.next_addend, command.next_addend, 500.0);
}

TEST(AddendServo, ignores_a_sample_from_before_its_last_command) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  node.run(plant, 2);
  ftcs_addend_sample early = plant.sample(kLatency);
  early.local_ns = node.servo.start_ns - 1'000;
  const ftcs_addend_command command = ftcs_addend_update(&node.servo, &early);
  EXPECT_EQ(command.verdict, FTCS_ADDEND_STALE);
  EXPECT_EQ(command.act, 0);
}

TEST(AddendServo, steps_once_at_the_start_if_it_may_and_never_if_it_may_not) {
  for (const bool may : {true, false}) {
    Plant plant(kInterval, 50'000.0, -3'000'000'000, 0.0);
    ftcs_addend_config config = plain();
    if (may) config.step_ns = 1'000'000;
    Node node(config);
    node.step(plant);
    const ftcs_addend_command first = node.step(plant);
    EXPECT_EQ(first.step_ns != 0, may);
    if (!may) continue;
    EXPECT_NEAR(static_cast<double>(first.step_ns), 3e9, 1e5);
    EXPECT_LT(std::abs(plant.true_offset_ns()), 100.0);
    for (int n = 0; n < 5; ++n) EXPECT_EQ(node.step(plant).step_ns, 0);
    EXPECT_LT(std::abs(plant.true_offset_ns()), 60.0);
  }
}

TEST(AddendServo, steps_a_clock_that_starts_in_1970) {
  Plant plant(kInterval, 50'000.0, 1'000'000 - Plant::kEpoch, 0.0);
  ftcs_addend_config config = plain();
  config.step_ns = 1'000'000;
  Node node(config);
  node.run(plant, 3);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 100'000.0);
  EXPECT_EQ(node.step(plant).step_ns, 0);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 100.0);
}

TEST(AddendServo, goes_on_when_somebody_else_stepped_the_clock_and_said_so) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  node.run(plant, 5);
  plant.clock().step(plant.event() - kFineNs, Fine{700'000} * kFineNs);
  ftcs_addend_stepped(&node.servo, 700'000);
  const std::uint32_t before = node.servo.addend;
  const ftcs_addend_command command = node.step(plant);
  EXPECT_EQ(command.verdict, FTCS_ADDEND_USED);
  EXPECT_NEAR(command.next_addend, before, 500.0);
}

TEST(AddendServo, locks_without_a_timer_too) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  ftcs_addend_config config = plain();
  config.no_timer = 1;
  Node node(config);
  node.step(plant);
  EXPECT_EQ(node.step(plant).until_ns, INT64_MAX);
  node.run(plant, 3);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 600.0);  // the correction went on for the latency
  node.run(plant, 60);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 60.0);
}

TEST(AddendServo, tells_elapsed_reference_time_while_a_correction_bends_the_clock) {
  Plant plant(kInterval, 50'000.0, 5'000'000, 0.0);  // 4 % of an interval
  Node node(plain());
  node.step(plant);
  const ftcs_addend_sample sample = plant.sample(kLatency);
  plant.obey(ftcs_addend_update(&node.servo, &sample), sample.now_ns);
  const Fine later = plant.event() + Fine{60'000'000} * kFineNs;
  const auto shown = static_cast<std::int64_t>(plant.clock().local_at(later) >> 32);
  const double wrong = static_cast<double>(shown - sample.local_ns) - 60e6 / 1.00005;
  const double elapsed = static_cast<double>(ftcs_addend_elapsed(&node.servo, shown)) / 65536.0;
  EXPECT_GT(std::abs(wrong), 2e6);
  EXPECT_NEAR(elapsed, 60e6 / 1.00005, 40.0);
}

TEST(AddendServo,
     coasts_after_four_intervals_of_silence_and_acts_in_full_on_the_first_sample_after) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 0.0);
  Node node(plain());
  node.run(plant, 8);
  const std::int64_t last = node.servo.local_ns;
  EXPECT_EQ(ftcs_addend_state_at(&node.servo, last + 3 * kInterval), FTCS_ADDEND_LOCKED);
  EXPECT_EQ(ftcs_addend_state_at(&node.servo, last + 6 * kInterval), FTCS_ADDEND_COASTING);
  EXPECT_STREQ(ftcs_addend_state_name(FTCS_ADDEND_COASTING), "coasting");
  plant.set_rate_ppb(51'000.0);
  plant.next(99);
  EXPECT_GT(std::abs(plant.true_offset_ns()), 1'000.0);
  node.step(plant);
  EXPECT_LT(std::abs(plant.true_offset_ns()), 60.0);
}

TEST(AddendServo, states_the_deviation_of_what_it_sees) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 35.0);
  Node node(quiet());
  node.run(plant, 300);
  const ftcs_addend_command command = node.step(plant);
  EXPECT_GT(command.deviation_ns, 20U);
  EXPECT_LT(command.deviation_ns, 70U);
}

TEST(AddendServo, rejects_a_late_message_in_quiet_mode_and_believes_the_second_in_a_row) {
  Plant plant(kInterval, 50'000.0, 1'000'000, 35.0);
  Node node(quiet());
  node.run(plant, 100);
  for (const auto verdict : {FTCS_ADDEND_REJECTED, FTCS_ADDEND_USED}) {
    ftcs_addend_sample late = plant.sample(kLatency);
    late.local_ns += 50'000;
    late.now_ns += 50'000;
    const ftcs_addend_command command = ftcs_addend_update(&node.servo, &late);
    plant.obey(command, late.now_ns);
    plant.next();
    EXPECT_EQ(command.verdict, verdict);
  }
}

TEST(AddendServo, shortens_its_memory_when_the_oscillator_wanders) {
  const auto memory_after = [](double wander_ppb) {
    Plant plant(1'000'000'000, 50'000.0, 1'000'000, 10.0);
    Node node(quiet());
    std::mt19937_64 random(7);
    std::normal_distribution<double> gauss(0.0, wander_ppb);
    double sum = 0.0;
    for (int n = 0; n < 2000; ++n) {
      node.step(plant);
      plant.set_rate_ppb(plant.rate_ppb() + gauss(random));
      if (n >= 1000) sum += node.servo.memory / 1000.0;
    }
    return sum;
  };
  EXPECT_GT(memory_after(0.0), 35.0);
  EXPECT_LT(memory_after(20.0), 15.0);
}

TEST(AddendServo, refuses_each_configuration_that_it_cannot_keep) {
  const auto error = [](auto&& change, std::uint32_t addend_now = Plant::kNominal) {
    ftcs_addend_config config = plain();
    change(config);
    ftcs_addend_servo servo;
    return ftcs_addend_init(&servo, &config, addend_now);
  };
  EXPECT_EQ(error([](auto&) {}), FTCS_ADDEND_OK);
  EXPECT_EQ(error([](auto& c) { c.nominal_addend = 0; }), FTCS_ADDEND_BAD_NOMINAL);
  EXPECT_EQ(error([](auto& c) { c.nominal_addend = 0xF0000000U; }), FTCS_ADDEND_BAD_NOMINAL);
  EXPECT_EQ(error([](auto& c) { c.limit_ppm = 0; }), FTCS_ADDEND_BAD_LIMIT);
  EXPECT_EQ(error([](auto& c) { c.plausible_ppm = 500'001; }), FTCS_ADDEND_BAD_LIMIT);
  EXPECT_EQ(error([](auto& c) { c.gain_q16 = 65'537; }), FTCS_ADDEND_BAD_GAIN);
  EXPECT_EQ(error([](auto& c) { c.band_leave_ns = 1; }), FTCS_ADDEND_BAD_BAND);
  EXPECT_EQ(error([](auto& c) { c.lock_leave_ns = 1; }), FTCS_ADDEND_BAD_BAND);
  EXPECT_EQ(error([](auto& c) { c.interval_ns = -1; }), FTCS_ADDEND_BAD_TIME);
  EXPECT_EQ(error([](auto& c) { c.step_ns = 1U << 28U; }), FTCS_ADDEND_BAD_TIME);
  EXPECT_EQ(error([](auto& c) { c.interval_ns = 10, c.correction_ns = 11; }), FTCS_ADDEND_BAD_TIME);
  EXPECT_EQ(error([](auto& c) { c = quiet(), c.quiet_memory = 7; }), FTCS_ADDEND_BAD_MEMORY);
  EXPECT_EQ(error([](auto& c) { c = quiet(), c.quiet_memory = 256; }), FTCS_ADDEND_BAD_MEMORY);
  EXPECT_EQ(error([](auto& c) { c.limit_ppm = 100; }, 0), FTCS_ADDEND_BAD_ADDEND);
  // A register that reaches only 1.2 times the nominal rate.
  EXPECT_EQ(ftcs_addend_default_config(3'579'139'413U).limit_ppm, 199'999U);
}

TEST(AddendServo, never_lets_a_clock_stand_still_however_small_its_nominal_addend) {
  for (std::uint32_t nominal = 1; nominal <= 20'000; ++nominal) {
    ftcs_addend_config config = ftcs_addend_default_config(nominal);
    ftcs_addend_servo servo;
    ASSERT_EQ(ftcs_addend_init(&servo, &config, nominal), FTCS_ADDEND_OK);
    ASSERT_GE(servo.slowest, 1U) << nominal;
    ASSERT_LE(servo.fastest, nominal + nominal / 2U) << nominal;
  }
}

// Any bits in any field. Built with the undefined-behaviour sanitizer.
TEST(AddendServo, keeps_every_addend_within_its_limits_whatever_it_is_fed) {
  std::mt19937_64 random(3);
  const auto any = [&random] {
    const auto bits = static_cast<std::int64_t>(random());
    switch (random() % 5) {
      case 0:
        return bits;
      case 1:
        return std::numeric_limits<std::int64_t>::max() - (bits & 3);
      case 2:
        return std::numeric_limits<std::int64_t>::min() + (bits & 3);
      default:
        return bits >> (random() % 60U);
    }
  };
  for (int run = 0; run < 20'000; ++run) {
    ftcs_addend_config config = random() % 2 == 0 ? plain() : quiet();
    config.limit_ppm = 1U + static_cast<std::uint32_t>(random() % 500'000U);
    config.step_ns = random() % 3 == 0 ? 1'000 : 0;
    config.no_timer = random() % 3 == 0 ? 1 : 0;
    Node node(config);
    ftcs_addend_sample sample{};
    for (int n = 0; n < 30; ++n) {
      const bool regular = random() % 2 == 0;
      sample.origin_ns =
          regular
              ? static_cast<std::int64_t>(static_cast<std::uint64_t>(sample.origin_ns) + 1'000'000U)
              : any();
      sample.local_ns =
          regular
              ? static_cast<std::int64_t>(static_cast<std::uint64_t>(sample.local_ns) + 1'000'100U)
              : any();
      sample.now_ns =
          regular ? static_cast<std::int64_t>(static_cast<std::uint64_t>(sample.local_ns) + 1'000U)
                  : any();
      sample.path_delay_scaled = any();
      sample.origin_fraction = static_cast<std::uint16_t>(any());
      sample.local_fraction = static_cast<std::uint16_t>(any());
      const ftcs_addend_command command = ftcs_addend_update(&node.servo, &sample);
      ASSERT_GE(command.addend, node.servo.slowest);
      ASSERT_LE(command.addend, node.servo.fastest);
      ASSERT_GE(command.next_addend, node.servo.slowest);
      ASSERT_LE(command.next_addend, node.servo.fastest);
      for (std::uint64_t again = random() % 8; again < 5; ++again)
        ftcs_addend_wrote(&node.servo, any(), static_cast<std::uint32_t>(any()),
                          static_cast<std::uint32_t>(any()));
      if (random() % 4 == 0) ftcs_addend_wrote_next(&node.servo, any());
      if (random() % 9 == 0) ftcs_addend_stepped(&node.servo, any());
      static_cast<void>(ftcs_addend_elapsed(&node.servo, any()));
      static_cast<void>(ftcs_addend_state_at(&node.servo, any()));
    }
  }
}

}  // namespace
}  // namespace ftcs::addend_test
