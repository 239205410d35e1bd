// SPDX-License-Identifier: MIT
// The world: a plant clock 30 ppm faster than the host's, read eight times a second.
#include "ftcs/fieldbus/plant_line.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "ftcs/fieldbus/plant_mailbox.h"

namespace ftcs::daemon {
namespace {

constexpr double kReadingNs = 125e6;

FreeRunningTime host(double ns) { return FreeRunningTime{Duration::from_ns(ns)}; }
ReferenceTime plant(double ns) {
  return ReferenceTime{Duration::from_ns(7e9 + ns * (1.0 + 30e-6))};
}

void read(PlantLine& line, int from, int to, double ahead_ns = 0.0) {
  for (int i = from; i < to; ++i) {
    line.add({host(i * kReadingNs), plant(i * kReadingNs) + Duration::from_ns(ahead_ns)});
  }
}

TEST(PlantLine, knows_plant_time_between_two_readings_and_behind_the_last) {
  PlantLine line;
  EXPECT_FALSE(line.at(host(0.0)));
  read(line, 0, 20);
  for (const double beyond_ns : {-60e6, 0.0, 124e6, 900e6}) {
    const double instant = 19 * kReadingNs + beyond_ns;
    const auto shown = line.at(host(instant));
    ASSERT_TRUE(shown);
    EXPECT_NEAR((*shown - plant(instant)).ns(), 0.0, 2.0) << beyond_ns;
  }
}

TEST(PlantLine, knows_nothing_a_second_after_the_last_reading) {
  PlantLine line;
  read(line, 0, 20);
  EXPECT_FALSE(line.at(host(19 * kReadingNs + 1.01e9)));
}

TEST(PlantLine, begins_anew_after_a_jump) {
  PlantLine line;
  read(line, 0, 20);
  read(line, 20, 22, 50'000.0);
  const double instant = 21.5 * kReadingNs;
  ASSERT_TRUE(line.at(host(instant)));
  EXPECT_NEAR((*line.at(host(instant)) - plant(instant)).ns(), 50'000.0, 2.0)
      << "no slope of what was before and after";
}

// A PTP receiver tells plant time with each message, and on a busy network those come in bursts.
TEST(PlantLine, has_the_slope_of_the_clock_and_not_of_a_burst_of_readings) {
  PlantLine line;
  double worst_ns = 0.0;
  for (int i = 0; i < 20; ++i) {
    const double burst = i * 2.0 * kReadingNs;
    for (int n = 0; n < 12; ++n) {
      const double instant = burst + n * 1e6;
      line.add({host(instant), plant(instant) + Duration::from_ns(n % 12 < 6 ? -200.0 : 200.0)});
    }
    const auto shown = line.at(host(burst + 200e6));
    ASSERT_TRUE(shown);
    worst_ns = std::max(worst_ns, std::abs((*shown - plant(burst + 200e6)).ns()));
  }
  EXPECT_LT(worst_ns, 8000.0) << "at first it has no slope";
  EXPECT_NEAR((*line.at(host(4.95e9)) - plant(4.95e9)).ns(), 0.0, 500.0);
}

TEST(PlantMailbox, gives_each_reading_once_and_never_a_half_of_one) {
  PlantMailbox mailbox;
  EXPECT_FALSE(mailbox.take());
  constexpr int kReadings = 200'000;
  std::thread writer([&mailbox] {
    for (int i = 1; i <= kReadings; ++i) {
      mailbox.put({FreeRunningTime::from_ns(i), ReferenceTime::from_ns(2 * i)});
    }
  });
  std::int64_t last = 0;
  while (last < kReadings) {
    const auto reading = mailbox.take();
    if (!reading) continue;
    const std::int64_t instant = reading->instant.since_epoch().rounded_ns();
    ASSERT_EQ(reading->plant.since_epoch().rounded_ns(), 2 * instant);
    ASSERT_GT(instant, last);
    last = instant;
  }
  writer.join();
  EXPECT_FALSE(mailbox.take());
}

}  // namespace
}  // namespace ftcs::daemon
