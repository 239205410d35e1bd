// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <gtest/gtest.h>

#include "addend_plant.h"

// What a user of a MAC with an addend register sees: 50 ppm, 1 ms ahead, 35 ns of gaussian noise,
// ticks of 20 ns, the register written 1 ms after the stamp. Beside it the formula of Zephyr's PTP
// time receiver, ppb = 0.7 e + 0.3 sum e with e in ns.
namespace ftcs::addend_test {
namespace {

constexpr int kSamples = 400;
constexpr std::int64_t kLatency = 1'000'000;
constexpr double kBand = 300.0;

struct Outcome {
  int within_from = 0;  ///< first sample from which the true offset stays within the band
  double rms = 0.0;     ///< of the true offset over the second half
  double worst = 0.0;
};

template <class Control>
Outcome run(std::int64_t interval_ms, Control&& control) {
  Plant plant(interval_ms * 1'000'000, 50'000.0, 1'000'000, 35.0);
  Outcome outcome;
  double squares = 0.0;
  for (int n = 0; n < kSamples; ++n) {
    const double offset = plant.true_offset_ns();
    if (!(std::abs(offset) <= kBand)) outcome.within_from = n + 1;
    if (n >= kSamples / 2) {
      squares += offset * offset;
      outcome.worst = std::max(outcome.worst, std::abs(offset));
    }
    control(plant);
    plant.next();
  }
  outcome.rms = std::sqrt(squares / (kSamples / 2));
  return outcome;
}

Outcome run_addend(std::int64_t interval_ms, const ftcs_addend_config& config) {
  ftcs_addend_servo servo;
  EXPECT_EQ(ftcs_addend_init(&servo, &config, Plant::kNominal), FTCS_ADDEND_OK);
  return run(interval_ms, [&servo](Plant& plant) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    plant.obey(ftcs_addend_update(&servo, &sample), sample.now_ns);
  });
}

Outcome run_zephyr_pi(std::int64_t interval_ms) {
  double drift = 0.0;
  return run(interval_ms, [&drift](Plant& plant) {
    const ftcs_addend_sample sample = plant.sample(kLatency);
    const auto error = static_cast<double>(sample.origin_ns - sample.local_ns);
    drift += 0.3 * error;
    const double ppb = std::clamp(0.7 * error + drift, -1e8, 1e8);
    const auto addend =
        static_cast<std::uint32_t>(std::llround(Plant::kNominal * (1.0 + ppb * 1e-9)));
    plant.obey({0, 0, 1, addend, addend, 0, INT64_MAX, 0, 0}, sample.now_ns);
  });
}

void print(const char* name, std::int64_t interval_ms, const Outcome& outcome) {
  std::printf(
      "%-22s %5lld ms  within 300 ns from sample %3d  settled rms %8.1f ns  worst %8.1f ns\n", name,
      static_cast<long long>(interval_ms), outcome.within_from, outcome.rms, outcome.worst);
}

constexpr std::int64_t kIntervals[] = {31, 125, 250, 500, 1000, 2000, 4000};

TEST(AddendTable, ftcs_is_within_300_ns_from_the_second_sample_on_at_every_interval) {
  for (const auto interval : kIntervals) {
    const Outcome ftcs = run_addend(interval, ftcs_addend_default_config(Plant::kNominal));
    print("ftcs_addend", interval, ftcs);
    EXPECT_LE(ftcs.within_from, 2) << interval;
    EXPECT_LT(ftcs.rms, 45.0) << interval;
  }
}

TEST(AddendTable, quiet_mode_locks_as_fast_and_settles_at_a_third_of_the_noise) {
  for (const auto interval : kIntervals) {
    const Outcome quiet = run_addend(interval, ftcs_addend_quiet_config(Plant::kNominal));
    print("ftcs_addend, quiet", interval, quiet);
    EXPECT_LE(quiet.within_from, 2) << interval;
    EXPECT_LT(quiet.rms, 12.0) << interval;
  }
}

TEST(AddendTable, the_formula_of_the_pi_depends_on_the_interval_and_diverges_at_four_seconds) {
  for (const auto interval : kIntervals) print("PI 0.7 / 0.3", interval, run_zephyr_pi(interval));
  EXPECT_GT(run_zephyr_pi(125).within_from, 100);
  EXPECT_GT(run_zephyr_pi(4000).rms, 1e6);
}

}  // namespace
}  // namespace ftcs::addend_test
