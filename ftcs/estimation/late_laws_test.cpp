// SPDX-License-Identifier: MIT
// World: test/support/loaded_path.h (125 ms, 20 ns of jitter, random walk 1e-9), and waits by laws
// that break one part of the estimator each when that part is taken away.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/listener_for_test.h"

namespace ftcs::estimation {
namespace {

using Random = std::mt19937_64;
using Law = std::function<double(Random&)>;

double uniform(Random& random) { return std::uniform_real_distribution<double>()(random); }

struct Errors {
  double rms = 0.0, largest = 0.0;  ///< ns, second half of the run
};

Errors run(const test::LoadedPathSpec& spec, std::uint64_t seed, const Law& law = {}) {
  const test::LoadedPath path(spec, seed);
  Random random(seed * 977);
  Listener listener(path);
  const double from = path.messages().back().heard_ns / 2.0;
  double squares = 0.0, count = 0.0;
  Errors errors;
  for (test::PathMessage message : path.messages()) {
    const double wait = law ? law(random) : 0.0;
    message.reading += sign_of(message.direction) * wait;
    if (message.direction == Direction::kBackward) message.time_ns += wait;
    listener.hear(message);
    if (message.heard_ns < from) continue;
    const double error = listener.offset_ns(message.time_ns) - path.offset_ns(message.time_ns);
    squares += error * error;
    count += 1.0;
    errors.largest = std::max(errors.largest, std::abs(error));
  }
  errors.rms = std::sqrt(squares / count);
  return errors;
}

double median_rms(const Law& law, std::uint64_t seeds) {
  std::vector<double> all;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) all.push_back(run({}, seed, law).rms);
  std::sort(all.begin(), all.end());
  return all[all.size() / 2];
}

// Without the rule of FloorEstimator::detect_changes() that a jump must show: 5,155 ns.
TEST(LateLaws, waits_of_whole_fragments_are_no_jumps) {
  const Law fragments = [](Random& random) {
    double wait = 0.0;
    for (int hop = 0; hop < 3; ++hop) {
      if (uniform(random) < 0.6) wait += std::min(9'802.0, 120e3 * uniform(random));
    }
    return wait;
  };
  EXPECT_LT(median_rms(fragments, 9), 20.0);
}

// Without LoadAwareEstimator::start_floor(): 178 ns.
TEST(LateLaws, a_load_that_appears_at_once_throws_no_seed) {
  test::LoadedPathSpec spec;
  test::TrafficSpec traffic;
  traffic.service_ns = 120e3;
  traffic.utilisation = [](double seconds) { return seconds < 400.0 ? 0.0 : 0.7; };
  traffic.hops = 2;
  spec.traffic = {traffic, traffic};
  double largest = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    largest = std::max(largest, run(spec, seed).largest);
  }
  EXPECT_LT(largest, 100.0);
}

// Without FloorEstimator::just_begun(): 3,413 ns, and as much in four of twenty. The rate steps by
// 2 ppm, a delay request is lost, and two Syncs are late in a row; what a queue would make of it
// the next delay request denies.
TEST(LateLaws, a_clock_that_runs_faster_is_no_queue) {
  test::LoadedPathSpec spec;
  spec.interval_s = 1.0;
  spec.cycles = 1000;
  spec.jitter_ns = 100.0;
  spec.event_s = 899.6;
  spec.rate_step = 2e-6;
  double largest = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const test::LoadedPath path(spec, seed);
    Listener listener(path);
    int late = 0;
    for (const test::PathMessage& message : path.messages()) {
      const bool forward = message.direction == Direction::kForward;
      const bool after = message.heard_ns > spec.event_s * 1e9;
      if (after && forward) ++late;
      if (after && !forward && late < 2) continue;
      listener.hear(message);
      if (!after || forward) continue;
      largest = std::max(
          largest, std::abs(listener.offset_ns(message.time_ns) - path.offset_ns(message.time_ns)));
      break;
    }
  }
  EXPECT_LT(largest, 1000.0);
}

}  // namespace
}  // namespace ftcs::estimation
