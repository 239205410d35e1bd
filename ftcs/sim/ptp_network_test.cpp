// SPDX-License-Identifier: MIT
// World: a grandmaster and time receivers that exchange octets over 10 us paths, 8 Syncs a second,
// 50 ppm of skew, 1 ms of initial offset.
#include "ftcs/sim/ptp_network.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

class Tail final : public TwoWayObserver {
 public:
  Tail(std::size_t node, double from_cycle) : node_(node), from_(from_cycle) {}
  void on_truth(const TruthSample& sample) override {
    if (sample.node != node_ || sample.cycle < from_) return;
    squares_ += sample.time_error_ns * sample.time_error_ns;
    ++count_;
  }
  void on_pair(const PairSample& sample) override {
    ++pairs;
    if (!sample.paces) ++beside;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares_ / count_); }
  int pairs = 0;
  int beside = 0;

 private:
  std::size_t node_;
  double from_;
  double squares_ = 0.0;
  double count_ = 0.0;
};

TwoWaySpec world(ServoKind kind, std::size_t hops, double jitter_ns) {
  NodeSpec node;
  node.oscillator.grid = Nanoseconds{125'000'000};
  node.oscillator.parts = {ConstantSkew{50e-6}};
  node.initial_offset = Nanoseconds{1'000'000};
  node.forward.delay = Nanoseconds{10'000};
  if (jitter_ns > 0.0) node.forward.jitter = GaussianJitter{jitter_ns};
  node.backward = node.forward;
  node.limits = RateLimits::symmetric_ppb(3e7);
  node.discipline.servo.kind = kind;
  node.discipline.servo.limits = node.limits;
  node.discipline.servo.sync_interval = Nanoseconds{125'000'000};
  TwoWaySpec spec;
  spec.interval = Nanoseconds{125'000'000};
  spec.cycles = 800;
  spec.nodes.assign(hops, node);
  return spec;
}

// Correction fields carry 2^-16 ns, stamps are exact: without noise the clock must be right to far
// below 1 ns.
TEST(PtpNetwork, without_noise_the_receiver_ends_up_on_the_grandmasters_time) {
  Tail tail(0, 400.0);
  const PtpRunCounters counters = run_ptp_network(world(ServoKind::kFtcs, 1, 0.0), 1, tail);
  EXPECT_LT(tail.rms(), 1.0);
  EXPECT_GT(counters.pairs, 1400U);
  EXPECT_GT(counters.messages, 3000U);
}

TEST(PtpNetwork, gives_the_servo_what_the_stamps_alone_would_give_it) {
  Tail octets(0, 400.0);
  run_ptp_network(world(ServoKind::kFtcs, 1, 100.0), 1, octets);
  Tail stamps(0, 400.0);
  run_two_way(world(ServoKind::kFtcs, 1, 100.0), 1, stamps);
  EXPECT_NEAR(octets.rms(), stamps.rms(), 0.2 * stamps.rms());
}

TEST(PtpNetwork, time_travels_down_a_chain_of_boundary_clocks) {
  Tail tail(4, 600.0);
  run_ptp_network(world(ServoKind::kKalman, 5, 20.0), 1, tail);
  EXPECT_LT(tail.rms(), 100.0);
}

TEST(PtpNetwork, peer_to_peer_without_noise_ends_up_on_the_grandmasters_time) {
  TwoWaySpec spec = world(ServoKind::kFtcs, 1, 0.0);
  spec.peer_to_peer = true;
  Tail tail(0, 400.0);
  run_ptp_network(spec, 1, tail);
  EXPECT_LT(tail.rms(), 1.0);
  EXPECT_EQ(tail.beside, 0) << "ftcs takes the link's delay and hears nothing else";
}

// Two stamps more an interval than end to end, and as many messages.
TEST(PtpNetwork, the_neighbours_stamps_are_time_for_the_adaptive_servo) {
  TwoWaySpec spec = world(ServoKind::kAdaptive, 1, 100.0);
  Tail end_to_end(0, 400.0);
  run_ptp_network(spec, 1, end_to_end);
  spec.peer_to_peer = true;
  Tail peer_to_peer(0, 400.0);
  run_ptp_network(spec, 1, peer_to_peer);
  EXPECT_GT(peer_to_peer.beside, 2 * 780);
  EXPECT_LT(peer_to_peer.rms(), 1.5 * end_to_end.rms());
}

TEST(PtpNetwork, a_link_that_changes_peer_to_peer_does_not_pull_the_clock_away) {
  TwoWaySpec spec = world(ServoKind::kAdaptive, 1, 100.0);
  spec.peer_to_peer = true;
  spec.nodes[0].forward.delay_steps = {{Nanoseconds{60'000'000'000}, Nanoseconds{3'000}}};
  spec.nodes[0].backward.delay_steps = spec.nodes[0].forward.delay_steps;
  Tail tail(0, 600.0);
  run_ptp_network(spec, 1, tail);
  EXPECT_LT(tail.rms(), 50.0);
}

TEST(PtpNetwork, lost_and_doubled_messages_are_survived) {
  TwoWaySpec spec = world(ServoKind::kFtcs, 1, 100.0);
  spec.nodes[0].forward.loss = 0.2;
  spec.nodes[0].forward.duplication = 0.2;
  spec.nodes[0].backward.loss = 0.2;
  Tail tail(0, 400.0);
  run_ptp_network(spec, 1, tail);
  // A lost Sync lets the rate noise of two samples (1100 ppb) run on for another interval or two.
  EXPECT_LT(tail.rms(), 1000.0);
}

TEST(PtpNetwork, repeats_itself_to_the_bit) {
  Tail first(0, 400.0);
  Tail second(0, 400.0);
  run_ptp_network(world(ServoKind::kFtcs, 1, 100.0), 9, first);
  run_ptp_network(world(ServoKind::kFtcs, 1, 100.0), 9, second);
  EXPECT_EQ(first.rms(), second.rms());
}

}  // namespace
}  // namespace ftcs::sim
