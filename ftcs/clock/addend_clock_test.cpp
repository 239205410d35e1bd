// SPDX-License-Identifier: MIT
#include "ftcs/clock/addend_clock.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::ManualSource;

// The world: an oscillator of some MHz whose ticks drive the registers of the paper's Fig. 2.
// Oracle: those registers themselves, moved tick by tick.
constexpr auto kStart = FreeRunningTime::from_ns(7'000);
constexpr auto kLocalStart = LocalTime::from_ns(1'000'000);

AddendClockConfig small_clock(std::uint32_t dither_ticks) {
  return {.nominal_frequency_hz = 125'000'000,  // 8 ns
          .accumulator_bits = 16,
          .increment = Duration::from_ns(10.5),
          .dither_ticks = dither_ticks,
          .free_running = kStart,
          .local = kLocalStart,
          .rate = {},
          .limits = {}};
}

ServoCommand correction(double correction_ratio, Duration time, double tracking_ratio) {
  return {.correction_rate = Rate::from_ratio(correction_ratio),
          .correction_time = time,
          .tracking_rate = Rate::from_ratio(tracking_ratio),
          .step = {}};
}
ServoCommand tracking(double ratio, Duration step = {}) {
  return {.correction_rate = {},
          .correction_time = {},
          .tracking_rate = Rate::from_ratio(ratio),
          .step = step};
}

// Accumulator and addend as hardware has them; the dithering as a software would do it, once per
// period.
struct Registers {
  AddendClockConfig config;
  double wanted = 0.0;
  double error = 0.0;
  std::uint64_t addend = 0;
  std::uint64_t accumulator = 0;
  std::uint64_t ticks_since_command = 0;
  LocalTime local;

  explicit Registers(const AddendClockConfig& configuration)
      : config(configuration), local(configuration.local) {
    set_rate(config.rate.ratio());
  }
  void set_rate(double ratio) {
    wanted = ratio * config.nominal_addend();
    if (config.dither_ticks == 0) wanted = std::round(wanted);
    wanted = std::round(wanted * 1048576.0) / 1048576.0;
    ticks_since_command = 0;
  }
  void tick() {
    if (config.dither_ticks == 0) {
      addend = static_cast<std::uint64_t>(wanted);
    } else if (ticks_since_command % config.dither_ticks == 0) {
      addend = static_cast<std::uint64_t>(std::floor(wanted + error));
      error += wanted - static_cast<double>(addend);
    }
    ++ticks_since_command;
    accumulator += addend;
    if ((accumulator >> config.accumulator_bits) != 0) {
      accumulator -= std::uint64_t{1} << config.accumulator_bits;
      local = local + config.increment;
    }
  }
};

TEST(AddendClock, agrees_with_its_registers_tick_by_tick) {
  for (const std::uint32_t dither_ticks : {0U, 1U, 4U, 64U}) {
    SCOPED_TRACE(dither_ticks);
    ManualSource source;
    source.instant = kStart;
    AddendClock clock{source, small_clock(dither_ticks)};
    Registers registers{small_clock(dither_ticks)};
    std::mt19937_64 random(dither_ticks);
    for (int command = 0; command < 50; ++command) {
      // A command begins a dither period: give it at the end of one.
      const std::uint64_t length = std::max(1U, dither_ticks) * (1 + random() % 40);
      for (std::uint64_t i = 0; i < length; ++i) {
        ASSERT_EQ(clock.read().local, registers.local);
        source.instant = source.instant + Duration{7ns};
        ASSERT_EQ(clock.read().local, registers.local) << "time may move at a tick only";
        source.instant = source.instant + Duration{1ns};
        registers.tick();
      }
      const double ratio = 0.8 + 0.4 * static_cast<double>(random() % 10'000) * 1e-4;
      ASSERT_TRUE(clock.apply(tracking(ratio)).ok());
      registers.set_rate(ratio);
    }
  }
}

TEST(AddendClock, mean_rate_is_the_commanded_one_when_dithered) {
  // 16 bits of addend are 20 ppm a unit: without dithering the rate is wrong by up to half of that.
  for (const double ppm : {-800.0, -13.3, 3.7, 123.456}) {
    const double ratio = 1.0 + ppm * 1e-6;
    ManualSource source;
    source.instant = kStart;
    AddendClock dithered{source, small_clock(16)};
    ASSERT_TRUE(dithered.apply(tracking(ratio)).ok());
    EXPECT_NEAR(dithered.rate_at(kStart).ppm(), ppm, 1e-4);
    AddendClock plain{source, small_clock(0)};
    ASSERT_TRUE(plain.apply(tracking(ratio)).ok());
    EXPECT_NEAR(plain.rate_at(kStart).ppm(), ppm, 0.5e6 / small_clock(0).nominal_addend() + 1e-6);
    source.instant = kStart + Duration{100s};
    // One increment, and what sixteen ticks of dithering can be behind.
    EXPECT_NEAR((dithered.read().local - kLocalStart).ns(), 100e9 * ratio, 12.0);
    EXPECT_NEAR((plain.read().local - kLocalStart).ns(), 100e9 * plain.rate_at(kStart).ratio(),
                11.0);
    EXPECT_GT(std::abs((plain.read().local - kLocalStart).ns() - 100e9 * ratio), 1e3);
  }
}

TEST(AddendClock, correction_expires_although_nobody_calls) {
  ManualSource source;
  source.instant = kStart;
  AddendClock clock{source, small_clock(1)};
  ASSERT_TRUE(clock.apply(correction(1.2, Duration{1s}, 1.0)).ok());
  source.instant = kStart + Duration{500ms};
  EXPECT_NEAR((clock.read().local - kLocalStart).ns(), 0.6e9, 11.0);
  EXPECT_NEAR(clock.rate_at(source.instant).ratio(), 1.2, 1e-9);
  source.instant = kStart + Duration{3s};
  EXPECT_NEAR((clock.read().local - kLocalStart).ns(), 3.2e9, 12.0);
  EXPECT_NEAR(clock.rate_at(source.instant).ratio(), 1.0, 1e-9);
  // Stamps of the correction arrive late.
  EXPECT_NEAR((clock.local_at(kStart + Duration{250ms}) - kLocalStart).ns(), 0.3e9, 11.0);
}

TEST(AddendClock, step_is_added_once) {
  ManualSource source;
  source.instant = kStart;
  AddendClock clock{source, small_clock(0)};
  const auto applied = clock.apply(tracking(1.0, Duration{-500us}));
  ASSERT_TRUE(applied.ok());
  EXPECT_EQ(applied->local, kLocalStart - Duration{500us});
  EXPECT_EQ(applied->free_running, kStart);
  ServoCommand command = correction(1.1, Duration{1ms}, 1.0);
  command.step = Duration{2ms};
  ASSERT_TRUE(clock.apply(command).ok());
  EXPECT_EQ(clock.read().local, kLocalStart + Duration{1500us});
  source.instant = kStart + Duration{10ms};
  EXPECT_NEAR((clock.read().local - kLocalStart).ns(), 11.6e6, 11.0 + 10e6 * 8e-6);
}

TEST(AddendClock, commands_in_the_midst_of_a_tick_lose_nothing) {
  // Commands at odd instants within a tick, in the midst of dither periods: the accumulator goes on
  // all the same.
  ManualSource source;
  source.instant = kStart;
  AddendClock clock{source, small_clock(0)};
  const test::ForbidAllocation guard;
  for (int i = 0; i < 100'000; ++i) {
    source.instant = source.instant + Duration{13ns};
    ASSERT_TRUE(clock.apply(tracking(1.0)).ok());
  }
  AddendClock undisturbed{source, small_clock(0)};
  EXPECT_EQ(clock.read().local, undisturbed.read().local);
}

TEST(AddendClock, dither_error_survives_commands) {
  ManualSource source;
  source.instant = kStart;
  AddendClock clock{source, small_clock(4)};
  const double ratio = 1.0 + 7.7e-6;
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_TRUE(clock.apply(tracking(ratio)).ok());
    source.instant = source.instant + Duration{8 * 4 * 3 * 1ns};  // three dither periods
  }
  const double elapsed = (source.instant - kStart).ns();
  EXPECT_NEAR((clock.read().local - kLocalStart).ns(), elapsed * ratio, 12.0);
}

TEST(AddendClock, counts_ticks_of_a_frequency_that_is_no_round_number) {
  ManualSource source;
  AddendClockConfig config = small_clock(0);
  config.nominal_frequency_hz = 926'000'000;  // the paper's Section IV
  config.accumulator_bits = 32;
  config.increment = Nanoseconds{2};
  ASSERT_TRUE(config.valid());
  const AddendClock clock{source, config};
  EXPECT_EQ(clock.ticks_at(kStart), 0);
  EXPECT_EQ(clock.ticks_at(kStart + Duration{1s}), 926'000'000);
  EXPECT_EQ(clock.ticks_at(kStart + Duration{1ns}), 0);
  EXPECT_EQ(clock.ticks_at(kStart + Duration::from_ns(1.08)), 1);  // a tick every 1.0799 ns
  EXPECT_EQ(clock.ticks_at(kStart - Duration{1ns}), -1);
  EXPECT_EQ(clock.ticks_at(kStart - Duration{1s}), -926'000'000);
  EXPECT_NEAR(config.nominal_addend(), 4294967296.0 / 1.852, 1e-6);
}

TEST(AddendClock, stamps_before_the_start_are_extrapolated) {
  ManualSource source;
  source.instant = kStart;
  const AddendClock clock{source, small_clock(0)};
  EXPECT_NEAR((clock.local_at(kStart - Duration{1ms}) - kLocalStart).ns(), -1e6, 11.0 + 1e6 * 1e-5);
}

TEST(AddendClock, limits_are_what_the_register_can_express) {
  ManualSource source;
  source.instant = kStart;
  AddendClockConfig config = small_clock(1);
  config.limits = {Rate::from_ratio(1e-9), Rate::from_ratio(1e5)};
  AddendClock clock{source, config};
  // f increment = 1.3125: the largest addend, 65535 of 65536, is a little slower.
  EXPECT_NEAR(clock.rate_limits().fastest.ratio(), 1.3125 * 65535.0 / 65536.0, 1e-12);
  EXPECT_NEAR(clock.rate_limits().slowest.ratio(), 1.3125 / 65536.0, 1e-12);
  ASSERT_TRUE(clock.apply(tracking(clock.rate_limits().fastest.ratio())).ok());
  source.instant = kStart + Duration{8 * 65'536 * 1ns};
  EXPECT_EQ(clock.read().local, kLocalStart + Duration::from_ns(10.5 * 65'535));
  EXPECT_EQ(clock.apply(tracking(1.32)).error(), ClockError::kRateOutOfLimits);
  EXPECT_EQ(clock.apply(tracking(std::numeric_limits<double>::quiet_NaN())).error(),
            ClockError::kNotFinite);
  config.limits = RateLimits::symmetric_ppb(1e5);
  EXPECT_EQ(AddendClock(source, config).rate_limits().fastest, Rate::from_ppb(1e5));
  config.rate = Rate::from_ratio(1.2);
  EXPECT_NEAR(AddendClock(source, config).rate_at(kStart).ppb(), 1e5, 1.0);
}

TEST(AddendClockConfig, knows_what_cannot_work) {
  EXPECT_TRUE(small_clock(0).valid());
  const auto with = [](auto change) {
    AddendClockConfig config = small_clock(0);
    change(config);
    return config.valid();
  };
  EXPECT_FALSE(with([](auto& c) { c.nominal_frequency_hz = 0; }));
  EXPECT_FALSE(with([](auto& c) { c.nominal_frequency_hz = 1'000'000'000'001; }));
  EXPECT_FALSE(with([](auto& c) { c.accumulator_bits = 7; }));
  EXPECT_FALSE(with([](auto& c) { c.accumulator_bits = 41; }));
  EXPECT_TRUE(with([](auto& c) { c.accumulator_bits = 8; }));
  EXPECT_TRUE(with([](auto& c) { c.accumulator_bits = 40; }));
  EXPECT_FALSE(with([](auto& c) { c.increment = Duration{}; }));
  EXPECT_FALSE(with([](auto& c) { c.increment = Duration{-10ns}; }));
  EXPECT_FALSE(with([](auto& c) { c.increment = Nanoseconds{8}; }));  // at most rate 1 - 2^-16
  EXPECT_FALSE(with([](auto& c) { c.increment = Duration{2ms}; }));
  EXPECT_FALSE(with([](auto& c) { c.limits.slowest = Rate::from_ratio(-1.0); }));
  // 1 THz, 1 ms an overflow: addend 1 is still too fast.
  EXPECT_FALSE(with([](auto& c) {
    c.nominal_frequency_hz = 1'000'000'000'000;
    c.increment = Duration{1ms};
  }));
  EXPECT_TRUE(with([](auto& c) {
    c.nominal_frequency_hz = 1'000'000'000'000;
    c.accumulator_bits = 40;
    c.increment = Duration{1ms};
  }));
}

}  // namespace
}  // namespace ftcs
