// SPDX-License-Identifier: MIT
#include "bare_metal.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

#include "ftcs_addend.h"

namespace {

std::int64_t oscillator_ns = 1'000'000'000;

// The example with a timer that is 50 ppm fast: true time is oscillator_ns / 1.00005.
TEST(BareMetalExample, locks_a_clock_made_of_a_timer_within_three_syncs) {
  constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;
  const std::int64_t start = oscillator_ns;
  const auto reference = [&](std::int64_t at) {
    return kEpoch + (at - start) - std::llround(static_cast<double>(at - start) * 5e-5 / 1.00005);
  };
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 30.0);
  ASSERT_EQ(bare_clock_start(12'345), FTCS_ADDEND_OK);  // in 1970
  std::int32_t state = FTCS_ADDEND_WAITING;
  double squares = 0.0;
  for (int n = 0; n < 400; ++n) {
    oscillator_ns += 125'006'250 + static_cast<std::int64_t>(random() % 1000);
    const std::int64_t error = bare_clock_now() - reference(oscillator_ns);
    if (n >= 3) {
      ASSERT_LT(std::abs(error), 300) << n;
    }
    if (n >= 200) squares += static_cast<double>(error * error) / 200;
    const std::int64_t receive = bare_clock_now() + std::llround(noise(random));
    const std::int64_t origin = reference(oscillator_ns);
    oscillator_ns += 400'000 + static_cast<std::int64_t>(random() % 500'000);
    state = bare_clock_sync(origin, receive, 0);
    if (n >= 2) {
      ASSERT_EQ(state, FTCS_ADDEND_LOCKED) << n;
    }
  }
  EXPECT_LT(std::sqrt(squares), 30.0);
}

}  // namespace

extern "C" std::uint32_t timer_ticks() { return static_cast<std::uint32_t>(oscillator_ns / 40); }
