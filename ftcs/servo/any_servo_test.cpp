// SPDX-License-Identifier: MIT
// World: two affine clocks, a Sync every 125 ms and a Delay_Req after it; then a hostile one, in
// which every stamp may be anything.
#include "ftcs/servo/any_servo.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "test/support/affine_plant.h"
#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {
using namespace std::chrono_literals;
using test::AffinePlant;

ServoConfig config_for(ServoKind kind) {
  ServoConfig config;
  config.kind = kind;
  config.sync_interval = 125ms;
  config.limits = RateLimits::symmetric_ppb(100e6);
  config.linuxptp_pi.first_step_threshold = 0ns;
  return config;
}

TEST(ServoKind, has_a_name_that_leads_back) {
  for (const ServoKindName& entry : kServoKinds) {
    EXPECT_EQ(servo_kind_from_name(entry.name), entry.kind);
    EXPECT_EQ(servo_kind_name(entry.kind), entry.name);
  }
  EXPECT_EQ(servo_kind_from_name("ftcs"), ServoKind::kFtcs);
  EXPECT_EQ(servo_kind_from_name("pics"), ServoKind::kPics);
  EXPECT_EQ(servo_kind_from_name("linuxptp-pi"), ServoKind::kLinuxptpPi);
  EXPECT_EQ(servo_kind_from_name("none"), ServoKind::kFreeRunning);
  EXPECT_EQ(servo_kind_from_name("FTCS"), std::nullopt);
  EXPECT_EQ(servo_kind_from_name(""), std::nullopt);
}

TEST(AnyServo, every_kind_but_none_brings_the_clock_to_the_reference) {
  for (const ServoKindName& entry : kServoKinds) {
    AffinePlant plant{1.0L / (1.0L + 50e-6L), Nanoseconds{10us}};
    AnyServo servo = make_servo(config_for(entry.kind));
    int commands = 0;
    const auto feed = [&](Direction direction, Duration reference_minus_now) {
      const test::ForbidAllocation guard;
      const TimestampPair pair{direction, plant.reference() + reference_minus_now, plant.local(),
                               plant.free_running()};
      const ServoUpdate update = servo.update(pair, plant.read());
      if (update.has_command) plant.apply(update.command);
      commands += update.has_command ? 1 : 0;
    };
    for (int n = 0; n < 200; ++n) {
      feed(Direction::kForward, Nanoseconds{-10us});
      plant.advance_reference(Nanoseconds{40ms});
      feed(Direction::kBackward, Nanoseconds{10us});
      plant.advance_reference(Nanoseconds{85ms});
    }
    if (entry.kind == ServoKind::kFreeRunning) {
      EXPECT_EQ(commands, 0);
    } else {
      // The regression needs four samples for its first line, the others two.
      EXPECT_GE(commands, entry.kind == ServoKind::kRegression ? 196 : 198) << entry.name;
      EXPECT_NEAR(plant.offset_ns(), 0.0, 1.0) << entry.name;
    }
    EXPECT_NEAR(servo.snapshot().rate_ratio.ppm(), -50.0, 0.1) << entry.name;
    servo.reset();
    EXPECT_FALSE(servo.snapshot().offset_known) << entry.name;
  }
}

TEST(AnyServo, common_interval_and_limits_reach_the_chosen_law) {
  ServoConfig config = config_for(ServoKind::kFtcs);
  config.two_way.fixed_path_delay = 0ns;
  config.sync_interval = 2s;
  config.limits = {Rate::from_ppm(-10.0), Rate::from_ratio(1.5)};
  config.ftcs.limits = {Rate::from_ratio(0.5), Rate::from_ppm(20.0)};
  config.ftcs.sync_interval = 1s;
  AnyServo servo = make_servo(config);
  const auto feed = [&servo](std::int64_t second, std::int64_t offset_ns) {
    const ClockReading now{FreeRunningTime::from_ns(second * 1'000'000'000),
                           LocalTime::from_ns(second * 1'000'000'000 + offset_ns)};
    return servo
        .update({Direction::kForward, ReferenceTime::from_ns(second * 1'000'000'000), now.local,
                 now.free_running},
                now)
        .command;
  };
  feed(0, 0);
  EXPECT_EQ(feed(1, 1'000'000).correction_rate, Rate::from_ppm(-10.0));
  EXPECT_EQ(feed(2, -10'000'000).correction_rate, Rate::from_ppm(20.0));
  EXPECT_EQ(feed(3, 0).correction_time, Duration{2s});
  config.sync_interval = 0ns;  // then the law's own
  servo = make_servo(config);
  feed(4, 0);
  EXPECT_EQ(feed(5, 0).correction_time, Duration{1s});
}

TEST(AnyServo, common_settings_reach_every_kind) {
  for (const ServoKindName& entry : kServoKinds) {
    ServoConfig config = config_for(entry.kind);
    config.two_way.fixed_path_delay = 10us;
    AnyServo servo = make_servo(config);
    AffinePlant plant{1.0L, Duration{}};
    for (int n = 0; n < 4; ++n) {  // no backward message ever
      const TimestampPair sync{Direction::kForward, plant.reference() - Nanoseconds{10us},
                               plant.local(), plant.free_running()};
      (void)servo.update(sync, plant.read());
      plant.advance_reference(Nanoseconds{125ms});
    }
    EXPECT_TRUE(servo.snapshot().offset_known) << entry.name;
    EXPECT_NEAR(servo.snapshot().path_delay.ns(), 10'000.0, 1e-6) << entry.name;
    config.sync_interval = -1ns;
    if (entry.kind == ServoKind::kFreeRunning) continue;  // has no use for an interval
    EXPECT_EQ(validate(config), ServoConfigError::kSyncInterval) << entry.name;
  }
}

TEST(AnyServo, a_step_reaches_the_law_that_needs_to_know) {
  ServoConfig config = config_for(ServoKind::kPics);
  config.two_way.fixed_path_delay = 0ns;
  config.pics.integral_gain = 0.0;
  AnyServo servo = make_servo(config);
  const auto rate_at = [&servo](std::int64_t ns, std::int64_t offset_ns) {
    const ClockReading now{FreeRunningTime::from_ns(ns), LocalTime::from_ns(ns + offset_ns)};
    return servo
        .update({Direction::kForward, ReferenceTime::from_ns(ns), now.local, now.free_running}, now)
        .command.tracking_rate;
  };
  EXPECT_EQ(rate_at(0, 1'000), Rate{});
  servo.on_step(Nanoseconds{-1'000});
  EXPECT_EQ(rate_at(125'000'000, 0), Rate{});
}

TEST(AnyServo, no_stamps_however_hostile_bring_out_a_rate_that_is_not_finite_or_beyond_the_limits) {
  std::mt19937_64 engine{7};
  const auto hostile = [&engine](std::int64_t near) {
    const std::uint64_t draw = engine();
    const auto any = static_cast<std::int64_t>(engine());
    if (draw % 8 == 0) return any;                        // anything at all
    if (draw % 8 == 1) return any >> (draw % 63);         // any magnitude
    if (draw % 8 == 2) return near;                       // repeated
    return near + static_cast<std::int64_t>(draw >> 36);  // up to 270 ms on
  };
  for (const ServoKindName& entry : kServoKinds) {
    for (const bool gate : {true, false}) {
      ServoConfig config = config_for(entry.kind);
      config.two_way.gate_enabled = gate;
      if (!gate) config.two_way.fixed_path_delay = 0ns;
      config.sync_interval = gate ? 125ms : 0ns;
      AnyServo servo = make_servo(config);
      std::int64_t reference = 0;
      std::int64_t free_running = 0;
      std::int64_t local = 0;
      for (int n = 0; n < 40'000; ++n) {
        reference = hostile(reference);
        free_running = hostile(free_running);
        local = hostile(local);
        const Direction direction = engine() % 4 == 0 ? Direction::kBackward : Direction::kForward;
        const ClockReading now{FreeRunningTime::from_ns(hostile(free_running)),
                               LocalTime::from_ns(hostile(local))};
        const ServoUpdate update =
            servo.update({direction, ReferenceTime::from_ns(reference), LocalTime::from_ns(local),
                          FreeRunningTime::from_ns(free_running)},
                         now);
        if (!update.has_command) continue;
        ASSERT_TRUE(config.limits.contains(update.command.correction_rate)) << entry.name << n;
        ASSERT_TRUE(config.limits.contains(update.command.tracking_rate)) << entry.name << n;
        ASSERT_GE(update.command.correction_time, Duration{}) << entry.name << n;
        if (n % 1000 == 999) servo.reset();
      }
    }
  }
}

TEST(ServoConfig, is_validated_for_the_chosen_kind_only) {
  ServoConfig config;
  for (const ServoKindName& entry : kServoKinds) {
    config.kind = entry.kind;
    EXPECT_EQ(validate(config), std::nullopt) << entry.name;
  }
  config.kind = ServoKind::kFtcs;
  config.pics.integral_gain = -1.0;
  config.linuxptp_pi.step_threshold = -1ns;
  config.free_running.plausible_ratio.slowest = Rate::from_ratio(2.0);
  EXPECT_EQ(validate(config), std::nullopt);
  config.kind = ServoKind::kPics;
  EXPECT_EQ(validate(config), ServoConfigError::kIntegralGain);
  config.kind = ServoKind::kLinuxptpPi;
  EXPECT_EQ(validate(config), ServoConfigError::kStepThreshold);
  config.kind = ServoKind::kFreeRunning;
  EXPECT_EQ(validate(config), ServoConfigError::kPlausibleRatio);
  config.kind = ServoKind::kFtcs;
  config.ftcs.correction_time = 126ms;
  EXPECT_EQ(validate(config), std::nullopt);  // the interval is to be measured
  config.sync_interval = 125ms;
  EXPECT_EQ(validate(config), ServoConfigError::kCorrectionTime);
  config.limits.slowest = Rate::from_ratio(0.0);
  EXPECT_EQ(validate(config), ServoConfigError::kRateLimits);
}

// What a kind does not take of two_way cannot be wrong for it.
TEST(ServoConfig, the_part_in_front_of_a_law_is_validated_with_it) {
  for (const ServoKindName& entry : kServoKinds) {
    const bool alone = entry.kind == ServoKind::kAdaptive || entry.kind == ServoKind::kKalman ||
                       entry.kind == ServoKind::kMinimumDelay;
    const auto wrong_if = [alone](ServoConfigError error) {
      return alone ? std::nullopt : std::optional{error};
    };
    ServoConfig config;
    config.kind = entry.kind;
    config.two_way.gate.warm_up = OutlierGate::kMemory + 1;
    EXPECT_EQ(validate(config), wrong_if(ServoConfigError::kOutlierGate)) << entry.name;
    config.two_way.gate_enabled = false;
    EXPECT_EQ(validate(config), std::nullopt) << entry.name;
    config.two_way.path_delay.lowest = config.two_way.path_delay.highest + 1ns;
    EXPECT_EQ(validate(config), wrong_if(ServoConfigError::kPathDelay)) << entry.name;
    config.two_way.path_delay = {.filter = {.length = 0}};
    EXPECT_EQ(validate(config), wrong_if(ServoConfigError::kPathDelay)) << entry.name;
    config.two_way.fixed_path_delay = 10us;
    EXPECT_EQ(validate(config), std::nullopt) << entry.name;
  }
}

TEST(ServoConfigError, every_error_has_its_own_sentence) {
  for (int a = 0; a <= static_cast<int>(ServoConfigError::kOutlierGate); ++a) {
    EXPECT_NE(describe(static_cast<ServoConfigError>(a)), "unknown configuration error");
    for (int b = 0; b < a; ++b) {
      EXPECT_NE(describe(static_cast<ServoConfigError>(a)),
                describe(static_cast<ServoConfigError>(b)));
    }
  }
}

}  // namespace
}  // namespace ftcs
