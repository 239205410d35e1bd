// SPDX-License-Identifier: MIT
// World: messages of both directions at x + y t + sign (d + n), the floor's
// noise normal of 20 ns, a share of them late by an exponential wait.
#include "ftcs/estimation/floor_fit.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

using Record = FloorRecord<128>;

struct World {
  double x = 5000.0, y = 6250.0, d = 10e3;
  double drift = 0.0;  ///< ns per cycle^2
  double noise = 20.0, mean_wait = 60e3;
  PerDirection<double> waiting{0.5, 0.5};  ///< share
};

Record record_of(const World& world, int cycles, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, world.noise);
  std::exponential_distribution<double> wait(1.0 / world.mean_wait);
  std::uniform_real_distribution<double> even(0.0, 1.0);
  Record record;
  double time = 0.0;
  for (int k = 0; k < 2 * cycles; ++k) {
    const Direction direction = kDirections[static_cast<std::size_t>(k % 2)];
    const double step = 0.5 + 0.4 * (even(random) - 0.5);
    time += step;
    record.elapse(step);
    const double late = even(random) < world.waiting[direction] ? wait(random) : 0.0;
    const double delay = world.d + normal(random) + late;
    const double offset = world.x + (world.y + 0.5 * world.drift * time) * time;
    const double z = offset + sign_of(direction) * delay;
    (void)record.push({direction, z, 0.0, false, 0.0});
  }
  return record;
}
PerDirection<RecordWindow> last(const Record& record, std::size_t wanted) {
  return {record.window(Direction::kForward, wanted), record.window(Direction::kBackward, wanted)};
}

TEST(FloorFit, finds_no_floor_where_waits_are_longer_than_their_density_holds) {
  for (const double mean_wait : {20e6, 300e6}) {
    World world;
    world.mean_wait = mean_wait;
    EXPECT_EQ(fit_floor(last(record_of(world, 128, 1), 128), 0.4).found, mean_wait < 60e6);
  }
}

TEST(FloorFit, finds_offset_rate_and_delay_where_most_messages_wait) {
  for (const double waiting : {0.3, 0.6, 0.8}) {
    World world;
    world.waiting = {waiting, waiting};
    int found = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const Record record = record_of(world, 128, seed);
      const FloorFit fit = fit_floor(last(record, 128), 0.4);
      if (!fit.found || fit.evidence < 10.0) continue;
      ++found;
      const double sigma = fit.offset_sigma_ns();
      EXPECT_LT(sigma, 40.0);
      EXPECT_NEAR(fit.estimate.d, world.d, 5.0 * fit.sigma() * std::sqrt(fit.estimate.dd)) << seed;
      EXPECT_NEAR(fit.estimate.y, world.y, 5.0 * fit.sigma() * std::sqrt(fit.estimate.yy)) << seed;
      EXPECT_NEAR(fit.noise.forward.share, 1.0 - waiting, 0.2) << seed;
      EXPECT_NEAR(fit.sigma(), world.noise, 12.0) << seed;
    }
    EXPECT_GE(found, 18) << waiting;
  }
}

// An oscillator that wanders while hardly any message reaches the floor.
TEST(FloorFit, finds_a_floor_under_a_rate_that_drifts) {
  World world;
  world.waiting = {0.8, 0.8};
  world.drift = 0.05;  // 410 ns in 128 cycles
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const FloorFit fit = fit_floor(last(record_of(world, 128, seed), 128), 0.4);
    if (!fit.found || fit.evidence < 10.0) continue;
    ++found;
    EXPECT_NEAR(fit.drift, world.drift, 0.02) << seed;
    EXPECT_NEAR(fit.sigma(), world.noise, 12.0) << seed;
    EXPECT_NEAR(fit.estimate.d, world.d, 5.0 * fit.sigma() * std::sqrt(fit.estimate.dd)) << seed;
  }
  EXPECT_GE(found, 18);
}

// What curves by more than messages wait is no line that they lie on.
TEST(FloorFit, a_drift_is_small_beside_the_waits) {
  World world;
  world.waiting = {0.8, 0.8};
  world.drift = 10.0;  // 82 us in 128 cycles
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const FloorFit fit = fit_floor(last(record_of(world, 128, seed), 128), 0.4);
    EXPECT_FALSE(fit.found && fit.drift != 0.0) << seed;
  }
}

TEST(FloorFit, is_the_same_curve_when_time_has_passed) {
  FloorFit fit;
  fit.estimate.x = 100.0;
  fit.estimate.y = 3.0;
  fit.drift = 0.5;
  const double later = fit.offset_at(7.0);
  fit.elapse(5.0);
  EXPECT_DOUBLE_EQ(fit.offset_at(2.0), later);
}

// The rate is known by the one: the other has its own level to tell.
TEST(FloorFit, a_direction_with_few_messages_at_the_floor_need_not_tell_the_rate) {
  World world;
  world.waiting = {0.8, 0.94};
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const FloorFit fit = fit_floor(last(record_of(world, 128, seed), 128), 0.4);
    if (!fit.found || fit.evidence < 10.0) continue;
    ++found;
    EXPECT_NEAR(fit.estimate.d, world.d, 100.0) << seed;
  }
  EXPECT_GE(found, 78);
}

TEST(FloorFit, finds_no_floor_where_every_message_waits) {
  World world;
  world.waiting = {1.0, 1.0};
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Record record = record_of(world, 128, seed);
    for (const std::size_t wanted : {16U, 64U, 128U}) {
      const FloorFit fit = fit_floor(last(record, wanted), 0.4);
      EXPECT_FALSE(fit.found && fit.evidence > 10.0) << seed << ' ' << wanted;
    }
  }
}

TEST(FloorFit, one_loaded_direction_suffices_as_proof) {
  World world;
  world.waiting = {0.8, 0.0};
  const FloorFit fit = fit_floor(last(record_of(world, 128, 3), 128), 0.4);
  EXPECT_TRUE(fit.found);
  EXPECT_TRUE(fit.clear(Direction::kBackward));
  EXPECT_FALSE(fit.clear(Direction::kForward));
  EXPECT_GT(fit.evidence, 10.0);
}

TEST(FloorFit, the_floor_of_a_path_that_has_become_longer_is_none) {
  World before;
  before.waiting = {0.0, 0.0};
  Record record = record_of(before, 40, 5);
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal(0.0, 20.0);
  for (int k = 0; k < 48; ++k) {
    const Direction direction = kDirections[static_cast<std::size_t>(k % 2)];
    record.elapse(0.5);
    const double z = before.x + before.y * (40.0 + 0.5 * k) +
                     sign_of(direction) * (before.d + 15e3 + normal(random));
    (void)record.push({direction, z, 0.0, false, 0.0});
  }
  EXPECT_FALSE(fit_floor(last(record, 64), 0.4).found);
}

TEST(FloorFit, asks_for_a_handful_of_messages_of_each_direction) {
  World world;
  EXPECT_FALSE(fit_floor(last(record_of(world, 4, 1), 128), 0.4).found);
  const Record empty;
  EXPECT_FALSE(fit_floor(last(empty, 128), 0.4).has_rate);
}

TEST(FloorNoise, its_density_is_one_in_all) {
  const FloorNoise noise{0.4, 20.0, 60e3};
  double sum = 0.0;
  for (double nu = -200.0; nu < 200.0; nu += 0.5) {
    double density = 0.0;
    (void)noise.at_floor(nu, density);
    sum += 0.5 * density;
  }
  for (double nu = 200.0; nu < 2e6; nu *= 1.001) {
    double density = 0.0;
    (void)noise.at_floor(nu, density);
    sum += 0.001 * nu * density;
  }
  EXPECT_NEAR(sum, 1.0, 0.1);
}

}  // namespace
}  // namespace ftcs::estimation
