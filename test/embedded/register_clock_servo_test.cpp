// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <gtest/gtest.h>

#include "addend_plant.h"
#include "ftcs/clock/register_clock.h"
#include "ftcs/servo/ftcs_servo.h"

// The servos of the core on a clock that stamps with what is steered (RegisterClock), where
// ftcs_addend is the servo in integers: the same hardware, the same band.
namespace ftcs::addend_test {
namespace {

class Mac final : public AddendRegister {
 public:
  explicit Mac(AddendLine& line) : line_(line) {}

  LocalTime now() noexcept override { return LocalTime{duration_of(line_.local_at(instant_))}; }
  void write(std::uint32_t addend) noexcept override { line_.write(instant_, addend); }
  void step(Duration by) noexcept override {
    line_.step(instant_, Fine{by.floor_ns()} * kFineNs + static_cast<Fine>(by.fraction()));
  }
  void alarm(LocalTime at) noexcept override {
    alarm_ = Fine{at.since_epoch().floor_ns() + 1} * kFineNs;
    armed_ = true;
  }
  void wait_until(Fine instant, RegisterClock& clock) {
    if (armed_ && line_.local_at(instant) >= alarm_) {
      instant_ = line_.free_at(alarm_);
      armed_ = false;
      clock.on_alarm();
    }
    instant_ = instant;
  }

 private:
  AddendLine& line_;
  Fine instant_ = 0;
  Fine alarm_ = 0;
  bool armed_ = false;
};

TEST(RegisterClock, lets_ftcs_in_double_lock_a_mac_in_one_interval) {
  for (const std::int64_t interval : {31'000'000LL, 125'000'000LL, 1'000'000'000LL}) {
    Plant plant(interval, 50'000.0, 1'000'000, 35.0, 3);
    Mac mac(plant.clock());
    RegisterClock clock(mac, {Plant::kNominal, Plant::kNominal, RateLimits::symmetric_ppb(1e8)});
    FtcsServo servo{FtcsConfig{}};
    for (int n = 0; n < 100; ++n) {
      mac.wait_until(plant.event(), clock);
      if (n >= 2) {
        ASSERT_LT(std::abs(plant.true_offset_ns()), 300.0) << interval << " ns, sample " << n;
      }
      const ftcs_addend_sample seen = plant.sample(1'000'000);
      mac.wait_until(plant.event() + Fine{1'000'000} * kFineNs, clock);
      const LocalTime stamp = LocalTime::from_ns(seen.local_ns);
      const ServoUpdate update = servo.update(
          {ReferenceTime::from_ns(seen.origin_ns), Duration{}, stamp, clock.from_stamp(stamp)},
          clock.read());
      if (update.has_command) {
        ASSERT_TRUE(clock.apply(update.command).ok());
      }
      plant.next();
    }
  }
}

}  // namespace
}  // namespace ftcs::addend_test
