// SPDX-License-Identifier: MIT
#include "ftcs/clock/register_clock.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

constexpr std::uint32_t kNominal = 0x4C30C30C;
constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;

// Registers as hardware has them: a line that bends where it is written, on an oscillator of its
// own.
class Hardware final : public AddendRegister {
 public:
  LocalTime now() noexcept override { return line_(oscillator_); }
  void write(std::uint32_t addend) noexcept override {
    ++writes_;
    addend_ = addend;
    line_ = line_.continued(oscillator_, Rate::from_ratio(static_cast<double>(addend) / kNominal));
  }
  void step(Duration by) noexcept override {
    line_ = line_.continued(oscillator_, line_.rate()).stepped(by);
  }
  void alarm(LocalTime at) noexcept override { alarm_ = at; }

  void advance(std::int64_t ns) { oscillator_ = oscillator_ + Nanoseconds{ns}; }
  /// As advance(), with the alarm at its moment.
  void advance(std::int64_t ns, RegisterClock& clock) {
    const FreeRunningTime end = oscillator_ + Nanoseconds{ns};
    if (alarm_ && line_(end) - *alarm_ >= Duration{}) {
      oscillator_ = line_.inverse(*alarm_) + Duration::from_ns(1.0);
      alarm_.reset();
      clock.on_alarm();
    }
    oscillator_ = end;
  }
  [[nodiscard]] FreeRunningTime oscillator() const { return oscillator_; }
  [[nodiscard]] std::optional<LocalTime> wanted_alarm() const { return alarm_; }
  [[nodiscard]] std::uint32_t addend() const { return addend_; }
  [[nodiscard]] int writes() const { return writes_; }

 private:
  FreeRunningTime oscillator_ = FreeRunningTime::from_ns(77);
  AffineMap<FreeRunningTime, LocalTime> line_{oscillator_, LocalTime::from_ns(kEpoch), Rate{}};
  std::optional<LocalTime> alarm_;
  std::uint32_t addend_ = kNominal;
  int writes_ = 0;
};

RegisterClockConfig config() { return {kNominal, kNominal, RateLimits::symmetric_ppb(1e8)}; }

ServoCommand command(double correction_ppb, double tracking_ppb, std::int64_t ms) {
  return {Rate::from_ppb(correction_ppb), Duration::from_whole_ns(ms * 1'000'000),
          Rate::from_ppb(tracking_ppb), Duration{}};
}

TEST(RegisterClock, writes_the_correction_then_at_its_end_the_tracking_addend) {
  Hardware hardware;
  RegisterClock clock(hardware, config());
  ASSERT_TRUE(clock.apply(command(2e6, 50'000, 100)).ok());
  EXPECT_EQ(hardware.addend(), std::llround(kNominal * 1.002));
  ASSERT_TRUE(hardware.wanted_alarm().has_value());
  // 100 ms of reference are 100 / 1.00005 ms of the oscillator.
  EXPECT_NEAR((*hardware.wanted_alarm() - LocalTime::from_ns(kEpoch)).ns(), 1e8 / 1.00005 * 1.002,
              1.0);
  hardware.advance(99'000'000, clock);
  EXPECT_EQ(hardware.writes(), 1);
  hardware.advance(2'000'000, clock);
  EXPECT_EQ(hardware.addend(), std::llround(kNominal * 1.00005));
  EXPECT_EQ(clock.addend(), hardware.addend());
}

TEST(RegisterClock, has_a_free_running_face_that_no_command_bends) {
  Hardware hardware;
  RegisterClock clock(hardware, config());
  const FreeRunningTime first = clock.now();
  const FreeRunningTime start = hardware.oscillator();
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(clock.apply(command(n % 7 * 1e6, (n % 5 - 2) * 20'000, 60)).ok());
    hardware.advance(125'000'000, clock);
    const LocalTime stamp = hardware.now();
    const Duration elapsed = clock.from_stamp(stamp) - first;
    ASSERT_LT(std::abs((elapsed - (hardware.oscillator() - start)).ns()), 1e-3) << n;
    ASSERT_LT(std::abs((clock.local_at(clock.from_stamp(stamp)) - stamp).ns()), 1e-6);
  }
}

TEST(RegisterClock, accounts_for_an_alarm_that_came_late) {
  Hardware hardware;
  RegisterClock clock(hardware, config());
  ASSERT_TRUE(clock.apply(command(1e6, 0, 50)).ok());
  const FreeRunningTime first = clock.now();
  const FreeRunningTime start = hardware.oscillator();
  hardware.advance(80'000'000);
  clock.on_alarm();  // 30 ms late
  EXPECT_EQ(hardware.addend(), kNominal);
  hardware.advance(20'000'000);
  EXPECT_LT(std::abs(((clock.now() - first) - (hardware.oscillator() - start)).ns()), 1e-3);
}

TEST(RegisterClock, ends_nothing_when_the_alarm_comes_early) {
  Hardware hardware;
  RegisterClock clock(hardware, config());
  ASSERT_TRUE(clock.apply(command(1e6, 0, 50)).ok());
  hardware.advance(10'000'000);
  clock.on_alarm();
  EXPECT_EQ(hardware.writes(), 1);
}

TEST(RegisterClock, steps_and_keeps_its_free_running_face) {
  Hardware hardware;
  RegisterClock clock(hardware, config());
  hardware.advance(1'000'000);
  const ClockReading before = clock.read();
  ServoCommand step = command(0, 0, 0);
  step.step = Duration::from_whole_ns(-3'000'000'000);
  ASSERT_TRUE(clock.apply(step).ok());
  hardware.advance(5'000'000);
  const ClockReading after = clock.read();
  EXPECT_NEAR((after.free_running - before.free_running).ns(), 5e6, 1e-3);
  EXPECT_NEAR((after.local - before.local).ns(), 5e6 - 3e9, 1e-3);
}

TEST(RegisterClock, refuses_what_its_register_cannot_hold_and_writes_nothing) {
  Hardware hardware;
  RegisterClockConfig wide = config();
  wide.nominal_addend = wide.addend = 0xE0000000;
  wide.limits = {Rate::from_ratio(0.5), Rate::from_ratio(1.5)};
  RegisterClock clock(hardware, wide);
  EXPECT_NEAR(clock.rate_limits().fastest.ratio(), 4294967295.0 / 0xE0000000, 1e-12);
  const auto too_fast = clock.apply(command(0, 2e8, 0));
  ASSERT_FALSE(too_fast.ok());
  EXPECT_EQ(too_fast.error(), ClockError::kRateOutOfLimits);
  const auto nothing = clock.apply({Rate::from_ratio(std::numeric_limits<double>::quiet_NaN()),
                                    Duration::from_whole_ns(5), Rate{}, Duration{}});
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error(), ClockError::kNotFinite);
  EXPECT_EQ(hardware.writes(), 0);
}

}  // namespace
}  // namespace ftcs
