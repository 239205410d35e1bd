// SPDX-License-Identifier: MIT
// World: an oscillator that starts 1 ms ahead and 50 ppm fast, with white and random-walk FM, on a
// 10 ms grid.
#include "ftcs/sim/oscillator.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

OscillatorSpec noisy() {
  return {FreeRunningTime::from_ns(1'000'000),
          Nanoseconds{10'000'000},
          {ConstantSkew{50e-6}, WhiteFm{1e-8}, RandomWalkFm{1e-7}}};
}

TEST(Oscillator, shows_its_initial_reading_at_time_zero) {
  Oscillator oscillator(noisy(), 1);
  EXPECT_EQ(oscillator.reading_at(TrueTime{}), FreeRunningTime::from_ns(1'000'000));
}

TEST(Oscillator, gains_its_skew) {
  Oscillator oscillator({FreeRunningTime{}, Nanoseconds{1'000'000'000}, {ConstantSkew{50e-6}}}, 1);
  const TrueTime day = TrueTime::from_ns(86'400'000'000'000);
  const Duration gained = oscillator.reading_at(day).since_epoch() - day.since_epoch();
  // A rate near 1 is held to 2^-53: 0.01 ns in a day.
  EXPECT_NEAR(gained.ns(), 86'400e9 * 50e-6, 0.01);
}

TEST(Oscillator, inverts_exactly_below_a_millionth_of_a_nanosecond) {
  Oscillator oscillator(noisy(), 3);
  RandomStream random(3, "instants");
  for (int i = 0; i < 20'000; ++i) {
    const auto cell = Duration::from_whole_ns(std::int64_t{377'777} * i);
    const TrueTime t{cell + Duration::from_ns(1e6 * random.uniform())};
    EXPECT_NEAR((oscillator.true_at(oscillator.reading_at(t)) - t).ns(), 0.0, 1e-6);
  }
}

TEST(Oscillator, is_continuous_across_cells) {
  Oscillator oscillator(noisy(), 5);
  for (int cell = 1; cell < 1000; ++cell) {
    const TrueTime edge = TrueTime::from_ns(std::int64_t{10'000'000} * cell);
    const TrueTime before{edge.since_epoch() - Duration::from_parts(0, 1)};
    const double step = (oscillator.reading_at(edge) - oscillator.reading_at(before)).ns();
    EXPECT_NEAR(step, 0.0, 1e-9);
  }
}

TEST(Oscillator, answers_for_the_past_as_it_did_then) {
  Oscillator oscillator(noisy(), 7);
  const TrueTime early = TrueTime::from_ns(123'456'789);
  const FreeRunningTime then = oscillator.reading_at(early);
  (void)oscillator.reading_at(TrueTime::from_ns(9'000'000'000));
  EXPECT_EQ(oscillator.reading_at(early), then);
}

}  // namespace
}  // namespace ftcs::sim
