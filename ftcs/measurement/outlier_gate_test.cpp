// SPDX-License-Identifier: MIT
#include "ftcs/measurement/outlier_gate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"

namespace ftcs {
namespace {

// The world: innovations that are white noise of 100 ns, disturbed by spikes, steps and changes of
// the noise.
struct Noise {
  std::mt19937 random;
  double sigma_ns = 100.0;

  explicit Noise(unsigned seed) : random(seed) {}
  double operator()() {
    // Sum of twelve uniform draws: normal enough, and the same numbers with every compiler.
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
    return sigma_ns * sum;
  }
  bool one_in(unsigned n) { return random() % n == 0; }
};

GateDecision decide(OutlierGate& gate, double ns) { return gate.decide(Duration::from_ns(ns)); }

TEST(OutlierGate, accepts_everything_while_warming_up) {
  OutlierGate gate;
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(gate.warm());
    EXPECT_EQ(decide(gate, i % 2 == 0 ? 1e6 : 3.0), GateDecision::kAccept);
  }
  EXPECT_TRUE(gate.warm());
  EXPECT_EQ(gate.counters().accepted, 8U);
  EXPECT_EQ(gate.counters().rejected, 0U);
}

TEST(OutlierGate, first_innovation_after_the_warm_up_can_be_rejected) {
  OutlierGate gate{{.warm_up = 3}};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(decide(gate, 1.0), GateDecision::kAccept);
  EXPECT_EQ(decide(gate, 1e6), GateDecision::kReject);
}

TEST(OutlierGate, its_spread_is_that_of_the_sorted_innovations) {
  std::mt19937 random(3);
  for (int round = 0; round < 2000; ++round) {
    OutlierGate gate;
    const std::size_t size = 1 + random() % OutlierGate::kMemory;
    std::vector<double> values(size);
    for (double& value : values) {
      value = static_cast<double>(random() % 7);  // many alike
      gate.observe(Duration::from_ns(value));
    }
    const auto middle = [](std::vector<double> of) {
      std::sort(of.begin(), of.end());
      return of[of.size() / 2];
    };
    const double centre = middle(values);
    for (double& value : values) value = std::abs(value - centre);
    ASSERT_EQ(gate.spread_ns(), std::max(1.4826 * middle(values), 1.0)) << "round " << round;
  }
}

TEST(OutlierGate, learns_from_what_it_is_only_shown) {
  OutlierGate gate;
  const auto show_eight = [&gate] {
    for (int i = 0; i < 8; ++i) gate.observe(Duration::from_ns(i % 2 == 0 ? 100.0 : -100.0));
  };
  show_eight();
  EXPECT_TRUE(gate.warm());
  EXPECT_EQ(decide(gate, 50.0), GateDecision::kAccept);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(decide(gate, 50'000.0), GateDecision::kReject) << "single outliers make no row";
    show_eight();
  }
  EXPECT_EQ(gate.counters().accepted, 1U) << "what is shown is not decided on";
}

TEST(OutlierGate, learns_the_spread) {
  OutlierGate gate;
  Noise noise(1);
  double sum = 0.0;
  for (int i = 0; i < 2'000; ++i) {
    (void)decide(gate, 5'000.0 + noise());
    if (i >= 32) sum += gate.spread_ns();
  }
  EXPECT_NEAR(sum / 1'968.0, 100.0, 6.0);
}

TEST(OutlierGate, nearly_all_plain_noise_passes) {
  OutlierGate gate;
  Noise noise(2);
  for (int i = 0; i < 100'000; ++i) (void)decide(gate, noise());
  EXPECT_LT(gate.counters().rejected, 20U);
  EXPECT_EQ(gate.counters().exits, 0U);
}

TEST(OutlierGate, spikes_are_rejected_at_two_and_at_ten_per_cent) {
  for (const unsigned one_in : {50U, 10U}) {
    OutlierGate gate;
    Noise noise(3);
    int spikes = 0;
    int passed = 0;
    int noise_rejected = 0;
    for (int i = 0; i < 20'000; ++i) {
      const bool spike = i >= 8 && noise.one_in(one_in);
      const bool accepted = decide(gate, noise() + (spike ? 100e3 : 0.0)) != GateDecision::kReject;
      if (spike) ++spikes;
      if (spike && accepted) ++passed;
      if (!spike && !accepted) ++noise_rejected;
    }
    EXPECT_GT(spikes, 20'000 / static_cast<int>(one_in) * 8 / 10);
    EXPECT_LE(passed, 1) << "one in "
                         << one_in;  // only five spikes in a row pass: 1e-5 at ten per cent
    EXPECT_LT(noise_rejected, 20);
  }
}

TEST(OutlierGate, true_step_is_followed_after_five_samples) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    OutlierGate gate;
    Noise noise(seed);
    for (int i = 0; i < 100; ++i) (void)decide(gate, noise());
    for (int i = 0; i < 4; ++i) ASSERT_EQ(decide(gate, 20e3 + noise()), GateDecision::kReject);
    ASSERT_EQ(decide(gate, 20e3 + noise()), GateDecision::kExit);
    // Whoever predicts has followed: the innovations are small again, and pass.
    for (int i = 0; i < 20; ++i) ASSERT_EQ(decide(gate, noise()), GateDecision::kAccept) << seed;
    EXPECT_EQ(gate.counters().exits, 1U);
  }
}

TEST(OutlierGate, rejections_must_be_in_a_row_to_exit) {
  OutlierGate gate{{.rejections_to_exit = 2}};
  Noise noise(4);
  for (int i = 0; i < 50; ++i) (void)decide(gate, noise());
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(decide(gate, 1e5), GateDecision::kReject);
    ASSERT_EQ(decide(gate, 0.0), GateDecision::kAccept);
  }
  EXPECT_EQ(gate.counters().exits, 0U);
  ASSERT_EQ(decide(gate, 1e5), GateDecision::kReject);
  EXPECT_EQ(decide(gate, 1e5), GateDecision::kExit);
  EXPECT_EQ(decide(gate, 1e5), GateDecision::kReject) << "an exit starts the count anew";
}

TEST(OutlierGate, noise_that_grows_does_not_lock_it_out) {
  for (const double factor : {2.0, 10.0, 1'000.0}) {
    OutlierGate gate;
    Noise noise(5);
    for (int i = 0; i < 100; ++i) (void)decide(gate, noise());
    noise.sigma_ns *= factor;
    for (int i = 0; i < 64; ++i) (void)decide(gate, noise());
    const auto before = gate.counters();
    for (int i = 0; i < 10'000; ++i) (void)decide(gate, noise());
    EXPECT_LT(gate.counters().rejected - before.rejected, 10U) << factor;
    EXPECT_EQ(gate.counters().exits, before.exits);
    if (factor == 2.0) {
      EXPECT_LT(before.rejected, 5U);
      EXPECT_EQ(before.exits, 0U);
    }
  }
}

TEST(OutlierGate, adapts_to_noise_that_shrinks) {
  OutlierGate gate;
  Noise noise(6);
  noise.sigma_ns = 10e3;
  for (int i = 0; i < 50; ++i) (void)decide(gate, noise());
  EXPECT_EQ(decide(gate, 20e3), GateDecision::kAccept);
  noise.sigma_ns = 100.0;
  for (int i = 0; i < 32; ++i) (void)decide(gate, noise());
  EXPECT_EQ(decide(gate, 20e3), GateDecision::kReject);
  EXPECT_EQ(decide(gate, -20e3), GateDecision::kReject);
}

TEST(OutlierGate, constant_bias_is_no_outlier) {
  OutlierGate gate;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(decide(gate, 1e6), GateDecision::kAccept);
  // All equal: the resolution of the stamps stands for the spread, six times is the limit.
  EXPECT_EQ(gate.spread_ns(), 1.0);
  EXPECT_EQ(decide(gate, 1e6 + 6.0), GateDecision::kAccept);
  EXPECT_EQ(decide(gate, 1e6 - 6.0), GateDecision::kAccept);
  EXPECT_EQ(decide(gate, 1e6 + 6.01), GateDecision::kReject);
  EXPECT_EQ(decide(gate, 1e6 - 6.01), GateDecision::kReject);
  OutlierGate coarse{{.resolution = Nanoseconds{10'000}}};
  for (int i = 0; i < 100; ++i)
    ASSERT_EQ(decide(coarse, i % 10 == 0 ? 10e3 : 0.0), GateDecision::kAccept);
}

TEST(OutlierGate, reset_forgets_all_but_the_counters) {
  OutlierGate gate{{.rejections_to_exit = 2}};
  Noise noise(7);
  for (int i = 0; i < 40; ++i) (void)decide(gate, noise());
  (void)decide(gate, 1e6);
  gate.reset();
  EXPECT_FALSE(gate.warm());
  EXPECT_EQ(gate.spread_ns(), 1.0);
  EXPECT_EQ(gate.counters().rejected, 1U);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(decide(gate, 1e6), GateDecision::kAccept);
  EXPECT_EQ(decide(gate, 2e6), GateDecision::kReject) << "the configuration is kept";
  EXPECT_EQ(decide(gate, 2e6), GateDecision::kExit);
}

TEST(OutlierGate, its_warm_up_ends_with_its_memory_at_the_latest) {
  OutlierGate gate{{.warm_up = 1000}};
  Noise noise(8);
  for (std::size_t i = 0; i < OutlierGate::kMemory; ++i) (void)decide(gate, noise());
  EXPECT_TRUE(gate.warm());
  EXPECT_EQ(decide(gate, 1e6), GateDecision::kReject);
}

TEST(OutlierGateConfig, tells_what_cannot_be_meant) {
  EXPECT_TRUE(OutlierGateConfig{}.valid());
  EXPECT_FALSE(OutlierGateConfig{.width = 0.0}.valid());
  EXPECT_FALSE(OutlierGateConfig{.width = std::numeric_limits<double>::quiet_NaN()}.valid());
  EXPECT_FALSE(OutlierGateConfig{.warm_up = 33}.valid());
  EXPECT_FALSE(OutlierGateConfig{.rejections_to_exit = 0}.valid());
  EXPECT_FALSE(OutlierGateConfig{.resolution = Nanoseconds{0}}.valid());
}

TEST(OutlierGate, survives_the_extremes_without_allocation) {
  OutlierGate gate;
  const test::ForbidAllocation guard;
  const auto most = Duration::from_whole_ns(std::numeric_limits<std::int64_t>::max());
  for (int i = 0; i < 1'000; ++i) {
    (void)gate.decide(i % 3 == 0 ? most : -most);
    ASSERT_TRUE(std::isfinite(gate.spread_ns()));
  }
  for (int i = 0; i < 40; ++i) (void)gate.decide(Duration{});
  EXPECT_EQ(gate.decide(Duration{}), GateDecision::kAccept);
}

}  // namespace
}  // namespace ftcs
