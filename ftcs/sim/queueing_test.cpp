// SPDX-License-Identifier: MIT
// World: one packet every 10 ms through loaded ports. Means by Pollaczek and Khinchine: the mean
// wait of M/G/1 is rate E[S^2] / (2 (1 - utilisation)); of the rest of a frame, utilisation
// E[S^2]/(2 E[S]).
#include "ftcs/sim/queueing.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/sim/link.h"

namespace ftcs::sim {
namespace {

constexpr double kFrame = 120'000.0;
constexpr Nanoseconds kGap{10'000'000};

QueueingLoad loaded(double utilisation) {
  QueueingLoad load;
  load.utilisation = utilisation;
  load.service_ns = kFrame;
  return load;
}

TrueTime packet_time(int n) { return TrueTime{} + Duration{n * kGap}; }

struct Waits {
  std::vector<double> ns;

  [[nodiscard]] double mean() const {
    double sum = 0.0;
    for (const double wait : ns) sum += wait;
    return sum / static_cast<double>(ns.size());
  }
  [[nodiscard]] double share_of_none() const {
    return static_cast<double>(std::count(ns.begin(), ns.end(), 0.0)) /
           static_cast<double>(ns.size());
  }
  [[nodiscard]] double largest() const { return *std::max_element(ns.begin(), ns.end()); }
};

Waits waits_of(const QueueingLoad& load, int from = 0, int to = 40'000) {
  QueueingPath path(load, 1, 0);
  Waits waits;
  for (int n = 0; n < to; ++n) {
    const double wait = path.wait_ns(packet_time(n));
    if (n >= from) waits.ns.push_back(wait);
  }
  return waits;
}

TEST(Queueing, ports_in_a_row_add_their_waits_and_share_no_traffic) {
  QueueingLoad load = loaded(0.4);
  const double one_port = 0.4 * kFrame / (2.0 * 0.6);
  EXPECT_NEAR(waits_of(load).mean(), one_port, 0.03 * one_port);
  EXPECT_NEAR(waits_of(load).share_of_none(), 0.6, 0.01);
  load.hops = 3;
  EXPECT_NEAR(waits_of(load).mean(), 3.0 * one_port, 0.09 * one_port);
  EXPECT_NEAR(waits_of(load).share_of_none(), 0.6 * 0.6 * 0.6, 0.01);
}

TEST(Queueing, a_mix_of_lengths_waits_by_its_second_moment) {
  QueueingLoad load = loaded(0.5);
  load.mix = TrafficMix::kG8261Model2;
  const double small = 64.0 / 1518.0;
  const double medium = 576.0 / 1518.0;
  const double mean = 0.3 * small + 0.1 * medium + 0.6;
  const double square = 0.3 * small * small + 0.1 * medium * medium + 0.6;
  const double expected = 0.5 / mean * square * kFrame / (2.0 * 0.5);
  EXPECT_NEAR(waits_of(load).mean(), expected, 0.03 * expected);
}

TEST(Queueing, priority_waits_for_the_frame_under_way_alone) {
  QueueingLoad load = loaded(0.8);
  load.scheduling = Scheduling::kPriority;
  const Waits waits = waits_of(load);
  EXPECT_NEAR(waits.mean(), 0.8 * kFrame / 2.0, 0.02 * kFrame);
  EXPECT_NEAR(waits.share_of_none(), 0.2, 0.01);
  EXPECT_LE(waits.largest(), kFrame);
}

TEST(Queueing, preemption_waits_for_a_fragment_at_most) {
  QueueingLoad load = loaded(0.8);
  load.scheduling = Scheduling::kPreemption;
  EXPECT_LE(waits_of(load).largest(), kFrame * 124.0 / 1518.0 + 1e-6);
  EXPECT_NEAR(waits_of(load).share_of_none(), 0.2, 0.01);
}

TEST(Queueing, the_load_changes_as_it_is_told) {
  const auto share_waiting = [](const QueueingLoad& load, int from, int to) {
    return 1.0 - waits_of(load, from, to).share_of_none();
  };
  QueueingLoad load = loaded(0.0);
  load.change = LoadChange{LoadChange::Kind::kStep, 0.6, 100.0};
  EXPECT_EQ(share_waiting(load, 0, 9'999), 0.0);
  EXPECT_NEAR(share_waiting(load, 10'001, 30'000), 0.6, 0.02);

  load = loaded(0.2);
  load.change = LoadChange{LoadChange::Kind::kSquare, 0.8, 100.0};
  EXPECT_NEAR(share_waiting(load, 20'001, 29'999), 0.2, 0.02);
  EXPECT_NEAR(share_waiting(load, 30'001, 39'999), 0.8, 0.02);

  load.change = LoadChange{LoadChange::Kind::kRamp, 0.8, 100.0};
  EXPECT_NEAR(share_waiting(load, 4'500, 5'500), 0.5, 0.06);
  EXPECT_NEAR(share_waiting(load, 9'500, 10'500), 0.79, 0.05);
}

// Busy periods far longer than the gap between packets: neighbours wait together.
TEST(Queueing, busy_periods_come_and_go_for_neighbours_alike) {
  QueueingLoad load = loaded(0.0);
  load.change = LoadChange{LoadChange::Kind::kOnOff, 0.9, 1.0, 9.0, 1.0};
  const Waits waits = waits_of(load, 0, 400'000);
  EXPECT_NEAR(1.0 - waits.share_of_none(), 0.09, 0.02);
  int both = 0;
  int second = 0;
  for (std::size_t i = 1; i < waits.ns.size(); ++i) {
    if (waits.ns[i] <= 0.0) continue;
    ++second;
    if (waits.ns[i - 1] > 0.0) ++both;
  }
  EXPECT_GT(both, second * 8 / 10);
}

LinkSpec plain_link() {
  LinkSpec spec;
  spec.delay = Nanoseconds{10'000};
  return spec;
}

TEST(Queueing, a_link_says_which_packets_met_nothing_but_jitter) {
  LinkSpec spec = plain_link();
  spec.jitter = GaussianJitter{20.0};
  spec.queueing = loaded(0.4);
  Link link(spec, 1, 0);
  int clean = 0;
  constexpr int kPackets = 20'000;
  for (int n = 0; n < kPackets; ++n) {
    const Arrivals arrivals = link.send(packet_time(n));
    const double late = (arrivals.times[0] - packet_time(n)).ns() - 10'000.0;
    if (arrivals.clean) {
      ++clean;
      EXPECT_LT(std::abs(late), 120.0);
    } else {
      EXPECT_GT(late, -120.0);
    }
  }
  EXPECT_NEAR(clean, 0.6 * kPackets, 0.01 * kPackets);
}

// Stalls of 200 us, 5 a second: a packet falls into one with a probability of 1 in 1000.
TEST(Queueing, a_host_that_stands_still_stamps_at_the_end_of_it) {
  LinkSpec spec = plain_link();
  spec.stalls = HostStalls{0.2, 200'000.0, true};
  Link forward(spec, 1, 0);
  Link backward(spec, 1, 1);
  int stalled = 0;
  int together = 0;
  double late_sum = 0.0;
  constexpr int kPackets = 400'000;
  for (int n = 0; n < kPackets; ++n) {
    const Arrivals one = forward.send(packet_time(n));
    const Arrivals other = backward.send(packet_time(n));
    if (one.clean) continue;
    ++stalled;
    late_sum += (one.times[0] - packet_time(n)).ns() - 10'000.0;
    if (!other.clean) ++together;
  }
  EXPECT_NEAR(stalled, 400, 80);
  EXPECT_NEAR(late_sum / stalled, 200'000.0,
              30'000.0);  // memoryless: the rest is as long as the whole
  EXPECT_EQ(together, stalled);
}

TEST(Queueing, recorded_delays_keep_their_order_and_histograms_their_shares) {
  LinkSpec spec = plain_link();
  spec.jitter = RecordedJitter{
      std::make_shared<const std::vector<double>>(std::vector<double>{0.0, 100.0, 200.0})};
  Link recorded(spec, 5, 0);
  double before = -1.0;
  for (int n = 0; n < 9; ++n) {
    const double late = (recorded.send(packet_time(n)).times[0] - packet_time(n)).ns() - 10'000.0;
    if (before >= 0.0) {
      EXPECT_DOUBLE_EQ(late, before == 200.0 ? 0.0 : before + 100.0);
    }
    before = late;
  }
  spec.jitter =
      HistogramJitter{std::make_shared<const std::vector<double>>(std::vector<double>{0.0, 500.0}),
                      std::make_shared<const std::vector<double>>(std::vector<double>{0.9, 1.0})};
  Link table(spec, 5, 0);
  int late = 0;
  for (int n = 0; n < 10'000; ++n)
    late += (table.send(packet_time(n)).times[0] - packet_time(n)).ns() > 10'250.0 ? 1 : 0;
  EXPECT_NEAR(late, 1'000, 100);
}

TEST(Queueing, a_pareto_tail_is_as_heavy_as_its_exponent_says) {
  LinkSpec spec = plain_link();
  spec.jitter = ParetoJitter{3.0, 1'000.0};
  Link link(spec, 1, 0);
  int beyond = 0;
  constexpr int kPackets = 100'000;
  for (int n = 0; n < kPackets; ++n)
    beyond += (link.send(packet_time(n)).times[0] - packet_time(n)).ns() > 19'000.0 ? 1 : 0;
  EXPECT_NEAR(beyond, kPackets / 1000, 35);  // (1 + 9)^-3
}

}  // namespace
}  // namespace ftcs::sim
