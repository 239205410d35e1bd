// SPDX-License-Identifier: MIT
// World: test/support/loaded_path.h without load; jitter of 100 ns, a clock
// that does not wander, one message in 300 of each direction early. Largest
// true error after the first 60 cycles, worst seed.
#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

#include "test/support/listener_for_test.h"

namespace ftcs::estimation {
namespace {

/// Hears one direction alone, its delay known.
class OneWay {
 public:
  explicit OneWay(const test::LoadedPath& path) : listener_(path, {10e3, 0.0}) {}
  void hear(const test::PathMessage& message) {
    if (message.direction == Direction::kForward) listener_.hear(message);
  }
  [[nodiscard]] double offset_ns(double now) const { return listener_.offset_ns(now); }

 private:
  Listener listener_;
};

template <class Estimator>
double worst_error(double interval_s, double sigmas) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::LoadedPathSpec spec;
    spec.interval_s = interval_s;
    spec.cycles = 1200;
    spec.jitter_ns = 100.0;
    spec.wander = 0.0;
    spec.early_share = 1.0 / 300.0;
    spec.early_ns = sigmas * spec.jitter_ns;
    const test::LoadedPath path(spec, seed);
    Estimator estimator(path);
    worst = std::max(worst, test::errors_of(estimator, path, 60.0).largest_ns);
  }
  return worst;
}

TEST(EarlyOutliers, do_not_move_the_clock_whatever_their_size) {
  for (const double interval_s : {1.0, 0.125}) {
    for (const double sigmas : {6.0, 8.0, 10.0, 16.0, 30.0}) {
      const double two_way = worst_error<Listener>(interval_s, sigmas);
      const double one_way = worst_error<OneWay>(interval_s, sigmas);
      std::printf("%5.3f s, %2.0f sigma early: two way %.0f ns, one way %.0f ns\n", interval_s,
                  sigmas, two_way, one_way);
      EXPECT_LE(two_way, 100.0) << sigmas;
      EXPECT_LE(one_way, 100.0) << sigmas;
    }
  }
}

}  // namespace
}  // namespace ftcs::estimation
