// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

#include "addend_world.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs_addend.h"

// The C library against FtcsServo: both see every sample of one clock, which the C library alone
// steers. FtcsServo is told the free-running oscillator; the C library has to know it from the
// steered clock's stamps and what it wrote.
namespace ftcs::addend_test {
namespace {

constexpr std::int64_t kTai = 1'700'000'000'000'000'000;

struct Tally {
  std::int64_t samples = 0;
  std::int64_t commands = 0;
  std::int64_t duplicates = 0;
  std::int64_t implausible = 0;
  std::int64_t limited = 0;
  std::int64_t off_by_one = 0;
};

class Scenario {
 public:
  explicit Scenario(std::uint64_t seed) : random_(seed) {
    const double lowest = std::log(1e6);
    interval_ = static_cast<std::int64_t>(std::exp(uniform(lowest, std::log(16e9))));
    nominal_ = static_cast<std::uint32_t>(uniform(0x40000000, 0xA0000000));
    config_ = ftcs_addend_default_config(nominal_);
    config_.limit_ppm = choice(3) == 0 ? 1'000 : (choice(2) == 0 ? 200'000 : 450'000);
    config_.gain_q16 = static_cast<std::uint32_t>(choice(65'537));
    if (choice(2) == 0) {
      config_.band_enter_ns = 100U + static_cast<std::uint32_t>(choice(1'000));
      config_.band_leave_ns = config_.band_enter_ns + static_cast<std::uint32_t>(choice(5'000));
    }
    config_.dwell = static_cast<std::uint16_t>(choice(4));
    if (choice(3) == 0) config_.interval_ns = interval_;
    if (choice(3) == 0) config_.correction_ns = interval_ / (2 + choice(5));
    rate_ppb_ = static_cast<std::int64_t>(uniform(-1, 1) * (choice(2) == 0 ? 15e6 : 100e3));
    noise_ = std::exp(uniform(0.0, std::log(500.0)));
    const double largest = 0.05 * static_cast<double>(interval_);
    offset_ = Fine{static_cast<std::int64_t>(uniform(-1, 1) * std::min(largest, 5e6))} * kFineNs;
  }

  void run(Tally& tally) {
    ftcs_addend_servo servo;
    ASSERT_EQ(ftcs_addend_init(&servo, &config_, nominal_), FTCS_ADDEND_OK);
    FtcsServo reference(reference_config());
    AddendLine clock(nominal_, 0, Fine{kTai} * kFineNs + offset_);
    Fine event = 0;
    for (int n = 0; n < 16; ++n) {
      event = event + gap();
      if (event != last_.event && choice(60) == 0)
        jump_ = jump_ + Fine{interval_} * kFineNs * (choice(2) == 0 ? 3 : -3);
      sample(clock, event, servo, reference, tally);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::int64_t choice(std::int64_t among) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(among));
  }

  FtcsConfig reference_config() const {
    const double limit = std::floor(nominal_ * 1e-6 * config_.limit_ppm) / nominal_;
    FtcsConfig config;
    config.sync_interval = Nanoseconds{config_.interval_ns};
    config.correction_time = Nanoseconds{config_.correction_ns};
    config.offset_gain = config_.gain_q16 / 65536.0;
    if (config_.band_enter_ns != FTCS_ADDEND_UNBOUNDED) {
      config.converged_band = {Nanoseconds{config_.band_enter_ns},
                               Nanoseconds{config_.band_leave_ns}};
    }
    config.converged_dwell = config_.dwell;
    config.limits = {Rate::from_ratio(1 - limit), Rate::from_ratio(1 + limit)};
    return config;
  }

  // Mostly an interval; now and then a lost message, an outage or a repeated message.
  Fine gap() {
    const auto kind = choice(40);
    if (kind == 0) return 0;  // the last message again
    const std::int64_t intervals = kind < 3 ? 2 : (kind == 3 ? 6 + choice(30) : 1);
    return Fine{static_cast<std::int64_t>(static_cast<double>(interval_) * uniform(0.98, 1.02))} *
           kFineNs * intervals;
  }

  // A message and what is noted of it.
  struct Message {
    Fine event = -1;
    Fine stamped = 0;
    Fine local = 0;
    Fine origin = 0;
    std::int64_t delay_scaled = 0;
  };

  // Stamps of both clocks, in units of 2^-16 ns as a protocol has them.
  Message perceive(const AddendLine& clock, Fine event) {
    Message m;
    m.event = event;
    m.stamped = event + static_cast<Fine>(uniform(-1, 1) * noise_ * 4294967296.0);
    m.local = (clock.local_at(m.stamped) >> 16) << 16;
    m.delay_scaled = 12'345'678 + choice(65'536);
    const Fine elapsed = event + floor_divide(event * rate_ppb_, 1'000'000'000);
    const Fine arrival = Fine{kTai} * kFineNs + elapsed + jump_;
    m.origin = ((arrival - (Fine{m.delay_scaled} << 16)) >> 16) << 16;
    return m;
  }

  void sample(AddendLine& clock, Fine event, ftcs_addend_servo& servo, FtcsServo& reference,
              Tally& tally) {
    if (event != last_.event) last_ = perceive(clock, event);
    const Message& m = last_;
    const auto latency =
        static_cast<std::int64_t>(uniform(0.0, 0.6) * static_cast<double>(interval_));
    const Fine later = clock.local_at(m.stamped + Fine{latency} * kFineNs);
    const auto now_ns = static_cast<std::int64_t>((later >> 32) + 1);
    const Fine now = clock.free_at(Fine{now_ns} * kFineNs);

    const ftcs_addend_sample in{static_cast<std::int64_t>(m.origin >> 32),
                                static_cast<std::int64_t>(m.local >> 32),
                                now_ns,
                                m.delay_scaled,
                                static_cast<std::uint16_t>(m.origin >> 16),
                                static_cast<std::uint16_t>(m.local >> 16)};
    const ftcs_addend_command got = ftcs_addend_update(&servo, &in);
    const SyncSample same{ReferenceTime{duration_of(m.origin)},
                          Duration::from_scaled_ns(m.delay_scaled), LocalTime{duration_of(m.local)},
                          FreeRunningTime{duration_of(m.stamped)}};
    const ServoUpdate wanted =
        reference.update(same, {FreeRunningTime{duration_of(now)}, LocalTime::from_ns(now_ns)});
    ++tally.samples;
    compare(got, wanted, now_ns, tally);
    if (got.act == 0) return;
    clock.write(now, got.addend);
    clock.write_at_reading(Fine{got.until_ns} * kFineNs, got.next_addend);
  }

  void compare(const ftcs_addend_command& got, const ServoUpdate& wanted, std::int64_t now_ns,
               Tally& tally) {
    ASSERT_EQ(got.verdict, wanted.verdict == SampleVerdict::kUsed        ? FTCS_ADDEND_USED
                           : wanted.verdict == SampleVerdict::kDuplicate ? FTCS_ADDEND_DUPLICATE
                                                                         : FTCS_ADDEND_IMPLAUSIBLE);
    ASSERT_EQ(got.act != 0, wanted.has_command);
    tally.duplicates += got.verdict == FTCS_ADDEND_DUPLICATE ? 1 : 0;
    tally.implausible += got.verdict == FTCS_ADDEND_IMPLAUSIBLE ? 1 : 0;
    if (!wanted.has_command) return;
    const ServoCommand& command = wanted.command;
    const auto addend =
        static_cast<std::int64_t>(std::llround(command.correction_rate.ratio() * nominal_));
    const auto next =
        static_cast<std::int64_t>(std::llround(command.tracking_rate.ratio() * nominal_));
    ASSERT_LE(std::abs(got.addend - addend), 1);
    ASSERT_LE(std::abs(got.next_addend - next), 1);
    ++tally.commands;
    tally.off_by_one += got.addend != addend ? 1 : 0;
    const RateLimits limits = reference_config().limits;
    tally.limited +=
        limits.clamp(command.correction_rate).ratio() == limits.slowest.ratio() ? 1 : 0;
    // Where F stops the tracking rate itself, ours takes the reference's rate for T_c's length.
    if (command.tracking_rate == limits.slowest || command.tracking_rate == limits.fastest) return;
    const double length =
        command.correction_time.ns() * (command.correction_rate / command.tracking_rate).ratio();
    ASSERT_NEAR(static_cast<double>(got.until_ns - now_ns), length, 1.0 + length * 3e-9);
  }

  std::mt19937_64 random_;
  ftcs_addend_config config_{};
  std::uint32_t nominal_ = 0;
  std::int64_t interval_ = 0;
  std::int64_t rate_ppb_ = 0;
  double noise_ = 0.0;
  Fine offset_ = 0;
  Fine jump_ = 0;
  Message last_;
};

TEST(AddendServo, decides_as_the_servo_in_double_does_in_a_hundred_thousand_random_scenarios) {
  constexpr std::uint64_t kScenarios = 100'000;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= kScenarios; ++seed) {
    Scenario(seed).run(tally);
    ASSERT_FALSE(HasFatalFailure()) << "seed " << seed;
  }
  std::printf(
      "%lld samples, %lld commands (%lld an addend of one unit beside, %lld at a limit), %lld "
      "duplicates, %lld jumps\n",
      static_cast<long long>(tally.samples), static_cast<long long>(tally.commands),
      static_cast<long long>(tally.off_by_one), static_cast<long long>(tally.limited),
      static_cast<long long>(tally.duplicates), static_cast<long long>(tally.implausible));
  // Each kind of decision was really asked for.
  EXPECT_GT(tally.commands, 1'000'000);
  EXPECT_GT(tally.limited, 1'000);
  EXPECT_GT(tally.duplicates, 10'000);
  EXPECT_GT(tally.implausible, 10'000);
}

}  // namespace
}  // namespace ftcs::addend_test
