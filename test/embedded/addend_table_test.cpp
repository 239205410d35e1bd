// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "addend_plant.h"

// What a user of a MAC with an addend register sees: 50 ppm, 1 ms ahead, 35 ns of gaussian noise,
// ticks of 20 ns with which no Sync lines up, the register written 1 ms after the stamp; 20 seeds.
// Beside it the formula of Zephyr's PTP time receiver, ppb = 0.7 e + 0.3 sum e with e in ns.
namespace ftcs::addend_test {
namespace {

constexpr int kSamples = 400;
constexpr int kSeeds = 20;
constexpr std::int64_t kLatency = 1'000'000;
constexpr double kBand = 300.0;

struct Outcome {
  int within_from = 0;  ///< first sample from which the true offset stays within the band
  double rms = 0.0;     ///< of the true offset over the second half
};

// Random walk of the oscillator's rate, in ppb over the square root of a second.
struct World {
  std::int64_t interval_ms = 125;
  double wander = 0.0;
};

template <class Control>
Outcome run(const World& world, std::uint64_t seed, Control&& control) {
  Plant plant(world.interval_ms * 1'000'000, 50'000.0, 1'000'000, 35.0, seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> walk(
      0.0, world.wander * std::sqrt(1e-3 * static_cast<double>(world.interval_ms)) + 1e-12);
  Outcome outcome;
  double squares = 0.0;
  for (int n = 0; n < kSamples; ++n) {
    const double offset = plant.true_offset_ns();
    if (!(std::abs(offset) <= kBand)) outcome.within_from = n + 1;
    if (n >= kSamples / 2) squares += offset * offset;
    control(plant);
    plant.next();
    plant.set_rate_ppb(plant.rate_ppb() + walk(random));
  }
  outcome.rms = std::sqrt(squares / (kSamples / 2));
  return outcome;
}

Outcome run_addend(const World& world, std::uint64_t seed, const ftcs_addend_config& config) {
  ftcs_addend_servo servo;
  EXPECT_EQ(ftcs_addend_init(&servo, &config, Plant::kNominal), FTCS_ADDEND_OK);
  return run(world, seed, [&servo](Plant& plant) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    plant.obey(ftcs_addend_update(&servo, &sample), sample.now_ns);
  });
}

Outcome run_zephyr_pi(const World& world, std::uint64_t seed) {
  double drift = 0.0;
  return run(world, seed, [&drift](Plant& plant) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    const auto error = static_cast<double>(sample.origin_ns - sample.local_ns);
    drift += 0.3 * error;
    const double ppb = std::clamp(0.7 * error + drift, -1e8, 1e8);
    const auto addend =
        static_cast<std::uint32_t>(std::llround(Plant::kNominal * (1.0 + ppb * 1e-9)));
    plant.obey({0, 0, 1, addend, addend, 0, INT64_MAX, 0, 0}, sample.now_ns);
  });
}

struct Summary {
  int latest = 0;       ///< of within_from
  double median = 0.0;  ///< of rms
  double worst = 0.0;
};

template <class Run>
Summary over_seeds(const char* name, const World& world, Run&& one) {
  std::vector<double> rms;
  Summary summary;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Outcome outcome = one(seed);
    rms.push_back(outcome.rms);
    summary.latest = std::max(summary.latest, outcome.within_from);
  }
  std::sort(rms.begin(), rms.end());
  summary.median = (rms[kSeeds / 2 - 1] + rms[kSeeds / 2]) / 2;
  summary.worst = rms.back();
  std::printf(
      "%-16s %5lld ms %4.1f ppb/sqrt(s)  within 300 ns from sample %3d at the latest  settled rms "
      "median %7.1f worst %7.1f ns\n",
      name, static_cast<long long>(world.interval_ms), world.wander, summary.latest, summary.median,
      summary.worst);
  return summary;
}

Summary of_ftcs(const World& world) {
  const ftcs_addend_config config = ftcs_addend_default_config(Plant::kNominal);
  return over_seeds("ftcs_addend", world,
                    [&](std::uint64_t seed) { return run_addend(world, seed, config); });
}
Summary of_quiet(const World& world, std::uint16_t memory = 64) {
  ftcs_addend_config config = ftcs_addend_quiet_config(Plant::kNominal);
  config.quiet_memory = memory;
  return over_seeds("quiet mode", world,
                    [&](std::uint64_t seed) { return run_addend(world, seed, config); });
}
Summary of_pi(const World& world) {
  return over_seeds("PI 0.7 / 0.3", world,
                    [&](std::uint64_t seed) { return run_zephyr_pi(world, seed); });
}

constexpr std::int64_t kIntervals[] = {31, 125, 250, 500, 1000, 2000, 4000};

TEST(AddendTable, ftcs_is_within_300_ns_from_the_second_sample_on_at_every_interval) {
  for (const auto interval : kIntervals) {
    const Summary ftcs = of_ftcs({interval, 0.0});
    EXPECT_LE(ftcs.latest, 2) << interval;
    EXPECT_LT(ftcs.worst, 45.0) << interval;
  }
}

TEST(AddendTable, quiet_mode_locks_as_fast_and_settles_at_a_third_of_the_noise) {
  for (const auto interval : kIntervals) {
    const Summary quiet = of_quiet({interval, 0.0});
    EXPECT_LE(quiet.latest, 2) << interval;
    EXPECT_LT(quiet.median, 12.0) << interval;
  }
}

TEST(AddendTable, quiet_mode_shortens_its_memory_where_the_oscillator_wanders) {
  for (const World world : {World{125, 1.0}, World{125, 10.0}, World{1000, 1.0}}) {
    const Summary ftcs = of_ftcs(world);
    const Summary quiet = of_quiet(world);
    EXPECT_LT(quiet.median, ftcs.median) << world.interval_ms << " ms, " << world.wander;
  }
}

TEST(AddendTable, the_formula_of_the_pi_depends_on_the_interval_and_diverges_at_four_seconds) {
  for (const auto interval : kIntervals) of_pi({interval, 0.0});
  EXPECT_GT(of_pi({125, 0.0}).latest, 100);
  EXPECT_GT(of_pi({4000, 0.0}).median, 1e6);
}

}  // namespace
}  // namespace ftcs::addend_test
