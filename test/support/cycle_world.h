// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "ftcs/discipline/cycle_servo.h"

namespace ftcs::test {

inline constexpr Nanoseconds kCycle{1'000'000};
inline constexpr Nanoseconds kTransit{700};

inline CycleServoConfig config_of(CycleLaw law) {
  CycleServoConfig config;
  config.law = law;
  config.cycles_per_sync = 100;
  config.transit = kTransit;
  return config;
}

/// A host whose clock is off by some ppm, wakes its task late by 20 to 120 us (known from a stamp,
/// 300 ns good), and a reference that a frame reaches 700 ns after it was sent. Cycle 1 ms.
/// Deterministic; uniform numbers made by hand.
struct World {
  explicit World(const CycleServoConfig& config) : servo(config) {
    decision = servo.start(FreeRunningTime::from_ns(3'141'592));
  }
  double uniform() {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) / 9007199254740992.0;
  }
  [[nodiscard]] ReferenceTime reference_at(FreeRunningTime t) const {
    return ReferenceTime{Nanoseconds{start}} + scale(t - FreeRunningTime{}, Rate::from_ppm(ppm)) +
           jump;
  }
  void set_ppm(double next) {
    const Duration before = reference_at(decision.wake).since_epoch();
    ppm = next;
    jump += before - reference_at(decision.wake).since_epoch();
  }
  /// Error of the virtual trigger itself against the grid of reference time, ns; early is positive.
  [[nodiscard]] double true_error() const {
    const std::int64_t cycle = servo.config().cycle.count();
    const std::int64_t at = reference_at(decision.virtual_instant).since_epoch().rounded_ns() -
                            servo.config().shift.count();
    const std::int64_t folded = ((at + cycle / 2) % cycle + cycle) % cycle - cycle / 2;
    return static_cast<double>(-folded);
  }
  void cycle(bool lost = false) {
    const Duration late = Duration::from_ns(20'000.0 + 100'000.0 * uniform()) + stall;
    CycleSample sample;
    sample.has_reference = !lost;
    const FreeRunningTime really_sent = decision.wake + late;
    sample.sent = really_sent + Duration::from_ns(stamp_noise * (uniform() - 0.5));
    sample.reference = reference_at(really_sent) + Duration{kTransit};
    sample.has_received = true;
    sample.received = sample.sent + round_trip;
    if (falsify_lateness) sample.sent = decision.wake - (sample.sent - decision.wake);
    if (mirror_reference) {
      const auto local = servo.local_at(sample.sent).since_epoch();
      sample.reference = ReferenceTime{local + local - sample.reference.since_epoch()};
    }
    if (change) change(sample);
    if (a_cycle_behind) {
      // Woken by this cycle's timer, the loop takes the frame of the cycle before.
      const FreeRunningTime woken = really_sent - Duration{kTransit};
      sample.scheduled = decision.wake;
      sample.has_scheduled = true;
      sample.has_received = false;
      std::swap(sample, in_flight);
      decision = servo.update(sample, woken);
    } else {
      decision = servo.update(sample, really_sent + round_trip);
    }
    stall = {};
  }
  void run(int n) {
    for (int i = 0; i < n; ++i) cycle();
  }
  /// RMS of the true error over n cycles.
  double rms(int n) {
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      cycle();
      sum += true_error() * true_error();
    }
    return std::sqrt(sum / n);
  }

  CycleServo servo;
  CycleDecision decision;
  double ppm = 50.0;
  std::int64_t start = 777'000'123'456;
  Duration jump{};
  double stamp_noise = 600.0;  // ±300 ns
  Duration stall{};
  Duration round_trip{Nanoseconds{60'000}};
  bool falsify_lateness = false;
  bool mirror_reference = false;
  void (*change)(CycleSample&) = nullptr;
  bool a_cycle_behind = false;
  CycleSample in_flight;
  std::uint64_t state = 42;
};

/// PICS has no rate of its own: what it runs at holds the correction of the phase too.
inline double rate_tolerance_ppm(CycleLaw law) { return law == CycleLaw::kPics ? 15.0 : 5.0; }

class EachLaw : public ::testing::TestWithParam<CycleLaw> {};

}  // namespace ftcs::test
