// SPDX-License-Identifier: MIT
// World: one direction of a 10 us path, a packet a millisecond, 50,000 packets.
#include "ftcs/sim/link.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::sim {
namespace {

constexpr int kPackets = 50'000;

struct Traffic {
  std::vector<double> delays_us;  ///< of every copy that arrived
  int lost = 0;
  int copies = 0;
  int overtaken = 0;
};

Traffic send_all(const LinkSpec& spec, std::uint64_t seed = 1) {
  Link link(spec, seed, 0);
  Traffic traffic;
  TrueTime latest{};
  for (int i = 0; i < kPackets; ++i) {
    const TrueTime departure = TrueTime::from_ns(i * std::int64_t{1'000'000});
    const Arrivals arrivals = link.send(departure);
    if (arrivals.count == 0) ++traffic.lost;
    if (arrivals.count == 2) ++traffic.copies;
    if (arrivals.count == 0) continue;
    traffic.delays_us.push_back((arrivals.times[0] - departure).ns() * 1e-3);
    if (arrivals.times[0] < latest) ++traffic.overtaken;
    latest = std::max(latest, arrivals.times[0]);
  }
  return traffic;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}
double deviation(const std::vector<double>& values) {
  const double centre = mean(values);
  double sum = 0.0;
  for (const double v : values) sum += (v - centre) * (v - centre);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

LinkSpec path() {
  LinkSpec spec;
  spec.delay = Nanoseconds{10'000};
  return spec;
}

TEST(Link, delivers_after_its_fixed_delay) {
  for (const double delay : send_all(path()).delays_us) ASSERT_DOUBLE_EQ(delay, 10.0);
}

TEST(Link, adds_jitter_of_the_asked_moments) {
  LinkSpec spec = path();
  spec.jitter = GaussianJitter{100.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 10.0, 0.002);
  EXPECT_NEAR(deviation(send_all(spec).delays_us), 0.1, 0.002);
  spec.jitter = ExponentialJitter{1000.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 11.0, 0.02);
  spec.jitter = GammaJitter{4.0, 250.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 11.0, 0.01);
  EXPECT_NEAR(deviation(send_all(spec).delays_us), 0.5, 0.01);
  spec.jitter = BimodalJitter{0.25, 4000.0, 10.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 11.0, 0.04);
}

TEST(Link, a_wave_of_the_stamps_has_a_mean_of_zero_and_half_its_height_as_deviation) {
  LinkSpec spec = path();
  spec.wave = StampWave{40.0, 0.37};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 10.0, 0.001);
  EXPECT_NEAR(deviation(send_all(spec).delays_us), 0.02, 0.001);
}

// Pollaczek-Khinchine: the mean wait of M/D/1 is rho service / (2 (1 - rho)).
TEST(Link, queueing_load_waits_as_an_m_d_1_queue_does) {
  LinkSpec spec = path();
  spec.queueing = QueueingLoad{0.5, 12'000.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 10.0 + 6.0, 0.2);
}

TEST(Link, loses_copies_and_holds_back_with_the_asked_probability) {
  LinkSpec spec = path();
  spec.loss = 0.3;
  spec.duplication = 0.1;
  spec.reordering = 0.05;
  spec.reordering_hold = Nanoseconds{1'500'000};
  const Traffic traffic = send_all(spec);
  EXPECT_NEAR(traffic.lost, 0.3 * kPackets, 500);
  EXPECT_NEAR(traffic.copies, 0.07 * kPackets, 300);
  EXPECT_GT(traffic.overtaken, 1000);
}

TEST(Link, in_order_never_lets_a_packet_overtake) {
  LinkSpec spec = path();
  spec.reordering = 0.05;
  spec.reordering_hold = Nanoseconds{2'500'000};
  spec.in_order = true;
  EXPECT_EQ(send_all(spec).overtaken, 0);
}

TEST(Link, steps_and_outages_happen_when_they_should) {
  LinkSpec spec = path();
  spec.delay_steps = {{Nanoseconds{1'000'000'000}, Nanoseconds{15'000}}};
  spec.outages = {{Nanoseconds{2'000'000'000}, Nanoseconds{3'000'000'000}}};
  const Traffic traffic = send_all(spec);
  EXPECT_EQ(traffic.lost, 1000);
  EXPECT_DOUBLE_EQ(traffic.delays_us[999], 10.0);
  EXPECT_DOUBLE_EQ(traffic.delays_us[1000], 25.0);
}

TEST(Link, a_burst_takes_its_share_of_the_time) {
  LinkSpec spec = path();
  spec.bursts = BurstyLoad{0.09, 0.01, 5000.0};
  EXPECT_NEAR(mean(send_all(spec).delays_us), 10.0 + 0.1 * 5.0, 0.15);
}

TEST(Link, gives_packet_n_the_same_jitter_whether_or_not_others_were_lost) {
  LinkSpec spec = path();
  spec.jitter = GaussianJitter{100.0};
  const Traffic all = send_all(spec);
  spec.outages = {{Nanoseconds{0}, Nanoseconds{10'000'000'000}}};
  const Traffic rest = send_all(spec);
  ASSERT_EQ(rest.delays_us.size(), all.delays_us.size() - 10'000);
  EXPECT_EQ(rest.delays_us.back(), all.delays_us.back());
}

}  // namespace
}  // namespace ftcs::sim
