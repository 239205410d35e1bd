// SPDX-License-Identifier: MIT
#include "ftcs/measurement/path_delay_estimator.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {
using namespace std::chrono_literals;

// The world: a reference and an oscillator that is `skew` fast and shows 3 s when the reference
// shows 0; a path of 10 us in either direction.
struct World {
  Rate skew = Rate::from_ppm(50.0);
  Duration delay = Nanoseconds{10'000};

  [[nodiscard]] FreeRunningTime free_at(Duration reference) const {
    return FreeRunningTime{Duration{3s} + scale(reference, skew)};
  }
  void forward(PathDelayEstimator& estimator, Duration t1) const {
    estimator.on_forward(ReferenceTime{t1}, free_at(t1 + delay));
  }
  PathDelayUpdate backward(PathDelayEstimator& estimator, Duration t3) const {
    return estimator.on_backward(free_at(t3), ReferenceTime{t3 + delay});
  }
};

TEST(PathDelayEstimator, first_exchange_is_right_in_spite_of_the_skew) {
  const World world;
  PathDelayEstimator estimator{PathDelayConfig{}};
  world.forward(estimator, Duration{});
  EXPECT_EQ(world.backward(estimator, Duration{100ms}).verdict, PathDelayVerdict::kDeferred);
  EXPECT_FALSE(estimator.known());
  world.forward(estimator, Duration{125ms});
  ASSERT_TRUE(estimator.known());
  EXPECT_NEAR(estimator.path_delay().ns(), 10'000.0, 1e-3);
}

}  // namespace
}  // namespace ftcs
