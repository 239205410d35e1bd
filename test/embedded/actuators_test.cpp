// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

#include "addend_plant.h"

// Headers in C, casts and all.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include "actuators/addend32.h"
#include "actuators/adjfine.h"
#include "actuators/enet.h"
#include "actuators/iep.h"
#pragma GCC diagnostic pop

namespace ftcs::addend_test {
namespace {

TEST(Addend32, has_a_nominal_addend_within_half_a_unit_for_the_clocks_of_known_parts) {
  struct Part {
    std::uint32_t hz;
    std::uint32_t increment;
  };
  for (const Part part :
       {Part{168'000'000, 20}, Part{216'000'000, 6}, Part{50'000'000, 40}, Part{240'000'000, 5}}) {
    const long double exact =
        4294967296.0L * 1e9L / (static_cast<long double>(part.hz) * part.increment);
    EXPECT_NEAR(static_cast<double>(ftcs_addend32_nominal(part.hz, part.increment) - exact), 0.0,
                0.5)
        << part.hz;
  }
  EXPECT_EQ(ftcs_addend32_nominal(168'000'000, 20), 0x4C30C30CU);
  EXPECT_EQ(ftcs_addend32_nominal(50'000'000, 20), 0U);  // addend 2^32: nothing left to speed up
  EXPECT_EQ(ftcs_addend32_nominal(0, 20), 0U);
  EXPECT_EQ(ftcs_addend32_nominal(~0U, ~0U), 0U);
}

// An STM32F4's registers: the addend is taken over when the hardware gets to it, the alarm fires at
// the target time.
struct Stm32Mac {
  std::uint32_t tsar = Plant::kNominal;
  std::uint32_t tscr = 0;
  std::uint32_t tthr = 0;
  std::uint32_t ttlr = 0;
  std::uint32_t active = Plant::kNominal;

  static constexpr std::uint32_t kUpdate = 1U << 5;
  static constexpr std::uint32_t kAlarm = 1U << 4;
  ftcs_addend32 registers() { return {&tsar, &tscr, &tthr, &ttlr, kUpdate, kAlarm}; }
  void tick() {
    if ((tscr & kUpdate) == 0) return;
    active = tsar;
    tscr &= ~kUpdate;
  }
  [[nodiscard]] std::int64_t target_ns() const { return std::int64_t{tthr} * 1'000'000'000 + ttlr; }
};

TEST(Addend32, waits_until_the_hardware_has_taken_the_last_addend_and_sets_the_alarm) {
  Stm32Mac mac;
  const ftcs_addend32 registers = mac.registers();
  EXPECT_EQ(ftcs_addend32_write(&registers, 1000), 1);
  EXPECT_EQ(ftcs_addend32_write(&registers, 2000), 0);
  EXPECT_EQ(mac.tsar, 1000U);
  mac.tick();
  EXPECT_EQ(mac.active, 1000U);
  EXPECT_EQ(ftcs_addend32_write(&registers, 2000), 1);
  ftcs_addend32_alarm(&registers, 1'700'000'001'999'999'999);
  EXPECT_EQ(mac.target_ns(), 1'700'000'001'999'999'999);
  EXPECT_NE(mac.tscr & Stm32Mac::kAlarm, 0U);
}

TEST(Addend32, locks_a_clock_through_its_registers) {
  Plant plant(125'000'000, 50'000.0, 1'000'000, 35.0);
  Stm32Mac mac;
  const ftcs_addend32 registers = mac.registers();
  const ftcs_addend_config config = ftcs_addend_default_config(Plant::kNominal);
  ftcs_addend_servo servo;
  ASSERT_EQ(ftcs_addend_init(&servo, &config, Plant::kNominal), FTCS_ADDEND_OK);
  for (int n = 0; n < 50; ++n) {
    if (n >= 2) {
      EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0) << n;
    }
    const ftcs_addend_sample sample = plant.sample(1'000'000);
    ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
    if (command.act != 0) {
      ASSERT_EQ(ftcs_addend32_write(&registers, command.addend), 1);
      ftcs_addend32_alarm(&registers, command.until_ns);
      mac.tick();
      command.addend = mac.active;
      command.until_ns = mac.target_ns();
    }
    plant.obey(command, sample.now_ns);
    plant.next();
  }
}

double enet_rate(const ftcs_enet_rate& r, std::uint32_t increment) {
  if (r.period == 0) return 1.0;
  return 1.0 + (static_cast<double>(r.increment_correction) - increment) /
                   (static_cast<double>(increment) * r.period);
}

TEST(Enet, tells_the_rate_that_its_registers_make_and_takes_the_best_pair) {
  std::mt19937 random(1);
  for (int n = 0; n < 20'000; ++n) {
    const std::uint32_t increment = n % 2 == 0 ? 40 : 20;
    const double wanted =
        1.0 + std::pow(10.0, -7.0 + 4.5 * static_cast<double>(random() % 1000) / 1000.0) *
                  (random() % 2 == 0 ? 1 : -1);
    const auto addend = static_cast<std::uint32_t>(std::llround(wanted * Plant::kNominal));
    const ftcs_enet_rate best = ftcs_enet_best(addend, Plant::kNominal, increment);
    ASSERT_LE(best.increment_correction, 127U);
    ASSERT_LT(best.period, 0x80000000U);
    const double made = enet_rate(best, increment);
    ASSERT_NEAR(made, static_cast<double>(best.addend) / Plant::kNominal, 1e-9);
    const double y = std::abs(wanted - 1.0);
    ASSERT_LT(std::abs(made - wanted),
              y * y * increment / 2 + 1e-9);  // never worse than INC +- 1 alone
  }
  const ftcs_enet_rate nothing = ftcs_enet_best(Plant::kNominal, Plant::kNominal, 40);
  EXPECT_EQ(nothing.period, 0U);
  EXPECT_EQ(nothing.addend, Plant::kNominal);
}

TEST(Enet, is_within_the_band_from_the_third_sample_on_at_25_mhz) {
  for (const std::int64_t interval : {125'000'000LL, 1'000'000'000LL}) {
    Plant plant(interval, 50'000.0, 1'000'000, 35.0);
    ftcs_addend_config config = ftcs_addend_default_config(Plant::kNominal);
    config.band_enter_ns = 300;  // the actuator is coarse: what it leaves is removed in full
    config.band_leave_ns = 1000;
    ftcs_addend_servo servo;
    ASSERT_EQ(ftcs_addend_init(&servo, &config, Plant::kNominal), FTCS_ADDEND_OK);
    for (int n = 0; n < 200; ++n) {
      if (n >= 3) {
        EXPECT_LT(std::abs(plant.true_offset_ns()), 300.0) << n;
      }
      const ftcs_addend_sample sample = plant.sample(1'000'000);
      ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
      if (command.act != 0) {
        command.addend = ftcs_enet_best(command.addend, Plant::kNominal, 40).addend;
        command.next_addend = ftcs_enet_best(command.next_addend, Plant::kNominal, 40).addend;
        ftcs_addend_wrote(&servo, sample.now_ns, command.addend, command.next_addend);
      }
      plant.obey(command, sample.now_ns);
      plant.next();
    }
  }
}

TEST(Iep, has_no_dead_band) {
  constexpr std::uint32_t kTicks = 25'000'000;  // 125 ms at 200 MHz
  for (const double ppb : {0.5, -0.5, 3.0, 47.3, -5'000.0, 50'000.0}) {
    ftcs_iep iep{5, 0xFFFFFF, 0};
    const auto addend =
        static_cast<std::uint32_t>(std::llround(Plant::kNominal * (1.0 + ppb * 1e-9)));
    const double wanted = (static_cast<double>(addend) / Plant::kNominal - 1.0) * 1e9;
    double made = 0.0;  // nanoseconds that were added
    constexpr int kSyncs = 4000;
    for (int n = 0; n < kSyncs; ++n) {
      const ftcs_iep_rate rate = ftcs_iep_next(&iep, addend, Plant::kNominal, kTicks);
      if (rate.period != 0) made += rate.sign * static_cast<double>(kTicks) / rate.period;
    }
    EXPECT_NEAR(made / (kSyncs * 5.0 * kTicks) * 1e9, wanted, 0.05 + std::abs(wanted) * 1e-5)
        << ppb;
  }
}

TEST(Adjfine, is_the_deviation_in_2_to_the_minus_16_ppm) {
  std::mt19937 random(2);
  for (int n = 0; n < 100'000; ++n) {
    const auto nominal = static_cast<std::uint32_t>(random()) | 0x10000000U;
    const auto addend = n % 3 == 0 ? static_cast<std::uint32_t>(random())
                                   : static_cast<std::uint32_t>(nominal + random() % 2000 - 1000);
    const long double exact = (static_cast<long double>(addend) / nominal - 1.0L) * 1e6L * 65536.0L;
    ASSERT_NEAR(static_cast<double>(ftcs_adjfine_scaled_ppm(addend, nominal) - exact), 0.0, 0.51);
  }
  EXPECT_EQ(ftcs_rate_ratio(3, 2), 1.5);
}

}  // namespace
}  // namespace ftcs::addend_test
