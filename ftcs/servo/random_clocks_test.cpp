// SPDX-License-Identifier: MIT
// World: a million random affine clocks. Oscillators off by up to ±10 %, offsets such that the rate
// limits do not bind, intervals from 50 us to 16 s (log-uniform), a random latency between sample
// and command. Noise-free FTCS must be on the reference one interval after the sample it first acts
// on, whatever the latency.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/servo/ftcs_servo.h"
#include "test/support/affine_plant.h"

namespace ftcs {
namespace {
using test::AffinePlant;

/// Portable on purpose: the standard does not say how its distributions use the engine.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double log_uniform(double low, double high) {
    return std::exp(uniform(std::log(low), std::log(high)));
  }

 private:
  std::mt19937_64 engine_;
};

struct RandomClock {
  Duration interval{};
  Duration latency{};
  double skew = 0.0;
  double offset_ns = 0.0;
};

RandomClock draw_clock(Draw& draw) {
  RandomClock clock;
  const double interval_ns = std::floor(draw.log_uniform(50e3, 16e9));
  clock.interval = Duration::from_ns(interval_ns);
  clock.latency = Duration::from_ns(std::floor(draw.uniform(0.0, 0.2) * interval_ns));
  clock.skew = draw.uniform(-0.1, 0.1);
  // ±12 % of the interval: up to seconds, and with the skew's own share inside the default limits.
  clock.offset_ns = draw.uniform(-0.12, 0.12) * interval_ns;
  return clock;
}

SyncSample exact(const SyncSample& sample) { return sample; }

SyncSample in_whole_nanoseconds(SyncSample sample) {
  sample.origin = ReferenceTime::from_ns(sample.origin.since_epoch().floor_ns());
  sample.local = LocalTime::from_ns(sample.local.since_epoch().floor_ns());
  sample.free_running = FreeRunningTime::from_ns(sample.free_running.since_epoch().floor_ns());
  return sample;
}

/// Offset one interval after the second sample, with the stamps that `stamp` makes of the true
/// times; not a number if there was no command.
template <class Stamp>
double landing_ns(const RandomClock& clock, AffinePlant plant, Stamp stamp) {
  FtcsConfig config;
  config.sync_interval = Nanoseconds{clock.interval.floor_ns()};
  FtcsServo servo{config};
  servo.prime(stamp(plant.sample()));
  plant.advance(clock.interval);
  const SyncSample sample = stamp(plant.sample());
  const ReferenceTime one_interval_later = plant.reference() + clock.interval;
  plant.advance(clock.latency);
  const ServoUpdate update = servo.update(sample, plant.read());
  if (!update.has_command) return std::nan("");
  plant.apply(update.command);
  plant.advance_reference(one_interval_later - plant.reference());
  return plant.offset_ns();
}

/// A rate is a double: half a unit in the last place (2^-53), a few times over, is 1e-6 ns after a
/// few seconds. Beyond, the bound grows with the interval.
double exact_bound_ns(const RandomClock& clock) {
  constexpr double kRateRounding = 6.0 * 0x1p-53;
  return std::max(1e-6, kRateRounding * clock.interval.ns());
}

TEST(FtcsServo, lands_a_million_random_clocks_on_the_reference) {
  constexpr int kClocks = 1'000'000;
  constexpr double kWholeNanosecondBound = 4.0;
  Draw draw{20170620};
  for (int n = 0; n < kClocks; ++n) {
    const RandomClock clock = draw_clock(draw);
    const AffinePlant plant{1.0L / (1.0L + static_cast<long double>(clock.skew)),
                            Duration::from_ns(clock.offset_ns)};
    const double fractional = std::abs(landing_ns(clock, plant, exact));
    const double whole = std::abs(landing_ns(clock, plant, in_whole_nanoseconds));
    // Negated, so that "no command" fails too.
    if (!(fractional < exact_bound_ns(clock)) || !(whole < kWholeNanosecondBound)) {
      FAIL() << "clock " << n << ", interval " << clock.interval.ns() << " ns, skew " << clock.skew
             << ", offset " << clock.offset_ns << " ns: off by " << fractional << " ns, and by "
             << whole << " ns with whole nanoseconds";
    }
  }
}

}  // namespace
}  // namespace ftcs
