// SPDX-License-Identifier: MIT
// World: one exchange a second over a 10 us path, 50 ppm of skew, 1 ms of initial offset, 100 ns of
// gaussian noise per packet and direction; 1200 cycles, the last 600 measured, error taken over the
// whole cycle (8 points). Oracles: ptp4l's own figures in this world (99 ns and 37.9 ns;
// linreg 24.3 ns), the least-squares bound.
#include "ftcs/sim/two_way.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

class Rms final : public TwoWayObserver {
 public:
  explicit Rms(std::size_t node = 0) : node_(node) {}
  void on_truth(const TruthSample& sample) override {
    if (sample.node != node_ || sample.cycle < 600.0) return;
    squares_ += sample.time_error_ns * sample.time_error_ns;
    ++count_;
  }
  void on_pair(const PairSample& sample) override { last_time_s_ = sample.time_s; }
  [[nodiscard]] double value() const { return std::sqrt(squares_ / count_); }
  [[nodiscard]] double last_time_s() const { return last_time_s_; }

 private:
  std::size_t node_;
  double squares_ = 0.0;
  double count_ = 0.0;
  double last_time_s_ = 0.0;
};

TwoWaySpec world(ServoKind kind, double interval_s) {
  NodeSpec node;
  node.oscillator.grid = Duration::from_ns(interval_s * 1e9 / 8.0);
  node.oscillator.parts = {ConstantSkew{50e-6}};
  node.initial_offset = Nanoseconds{1'000'000};
  node.forward.delay = Nanoseconds{10'000};
  node.forward.jitter = GaussianJitter{100.0};
  node.backward = node.forward;
  node.limits = RateLimits::symmetric_ppb(3e7);
  ServoConfig& servo = node.discipline.servo;
  servo.kind = kind;
  servo.limits = node.limits;
  servo.sync_interval = Nanoseconds{Duration::from_ns(interval_s * 1e9).rounded_ns()};
  servo.kalman.noise.random_walk_fm_1s = 0.0;
  node.discipline.step.mode = StepMode::kFirst;
  if (kind == ServoKind::kLinuxptpPi) {
    servo.two_way.path_delay.rate_compensated = false;
    servo.two_way.path_delay.lowest = Nanoseconds{-100'000'000};
    servo.two_way.gate_enabled = false;
  }
  TwoWaySpec spec;
  spec.interval = Duration::from_ns(interval_s * 1e9);
  spec.cycles = 1200;
  spec.nodes = {node};
  return spec;
}

double median_rms(const TwoWaySpec& spec, std::size_t node = 0) {
  std::vector<double> values;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rms rms(node);
    run_two_way(spec, seed, rms);
    values.push_back(rms.value());
  }
  std::sort(values.begin(), values.end());
  return 0.5 * (values[9] + values[10]);
}

TEST(TwoWayCalibration, linuxptp_pi_reaches_the_figures_of_ptp4l) {
  EXPECT_NEAR(median_rms(world(ServoKind::kLinuxptpPi, 1.0)), 99.0, 9.9);
  EXPECT_NEAR(median_rms(world(ServoKind::kLinuxptpPi, 0.125)), 37.9, 3.79);
}

TEST(TwoWayCalibration, regression_reaches_the_figures_of_linreg) {
  EXPECT_NEAR(median_rms(world(ServoKind::kRegression, 1.0)), 24.3, 0.15 * 24.3);
  EXPECT_NEAR(median_rms(world(ServoKind::kRegression, 0.125)), 24.3, 0.15 * 24.3);
}

// A constant frequency from N exchanges: about 1.41 sigma / sqrt(N) at the newest point (1 sigma),
// N = 600 .. 1200.
TEST(TwoWayCalibration, the_known_noise_filter_reaches_the_least_squares_bound) {
  const double rms = median_rms(world(ServoKind::kKalman, 1.0));
  EXPECT_GT(rms, 2.0);
  EXPECT_LT(rms, 6.0);
}

TEST(TwoWay, repeats_itself_to_the_bit_and_differs_by_seed) {
  const TwoWaySpec spec = world(ServoKind::kFtcs, 1.0);
  Rms first;
  Rms again;
  Rms other;
  run_two_way(spec, 3, first);
  run_two_way(spec, 3, again);
  run_two_way(spec, 4, other);
  EXPECT_EQ(first.value(), again.value());
  EXPECT_NE(first.value(), other.value());
}

/// Times at which messages were handled: the packets themselves.
class PacketTimes final : public TwoWayObserver {
 public:
  void on_pair(const PairSample& sample) override { times.push_back(sample.time_s); }
  std::vector<double> times;
};

TEST(TwoWay, every_servo_meets_the_same_packets) {
  PacketTimes ftcs;
  PacketTimes pi;
  run_two_way(world(ServoKind::kFtcs, 1.0), 5, ftcs);
  run_two_way(world(ServoKind::kLinuxptpPi, 1.0), 5, pi);
  EXPECT_EQ(ftcs.times, pi.times);
}

TEST(TwoWay, a_chain_of_boundary_clocks_is_followed_to_its_end) {
  TwoWaySpec spec = world(ServoKind::kFtcs, 1.0);
  const NodeSpec node = spec.nodes.front();
  spec.nodes.resize(8, node);
  const double first = median_rms(spec, 0);
  const double last = median_rms(spec, 7);
  EXPECT_GT(last, first);  // noise adds up
  EXPECT_LT(last, 20.0 * first);
}

TEST(TwoWay, outage_loss_and_steps_do_not_end_the_world) {
  TwoWaySpec spec = world(ServoKind::kFtcs, 1.0);
  NodeSpec& node = spec.nodes.front();
  node.forward.loss = node.backward.loss = 0.3;
  node.forward.duplication = 0.1;
  node.forward.outages = {{Nanoseconds{100'000'000'000}, Nanoseconds{160'000'000'000}}};
  spec.reference_steps = {{Nanoseconds{300'000'000'000}, Nanoseconds{20'000}}};
  spec.interval_spread = 3.0;
  Rms rms;
  run_two_way(spec, 1, rms);
  // Two samples 0.33 s apart give a rate wrong by 400 ppb, held for up to 9 s: microseconds, not
  // the 20 of the step.
  EXPECT_LT(rms.value(), 10'000.0);
}

}  // namespace
}  // namespace ftcs::sim
