// SPDX-License-Identifier: MIT
// World: delays of one link of 10 us, as exchanges of two messages tell them: half of what both
// messages were late by. Beside it the moving median of ten, which must be the worse.
#include "ftcs/measurement/steady_mean.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/measurement/delay_filter.h"

namespace ftcs {
namespace {

constexpr double kLink = 10'000.0;

class Messages {
 public:
  explicit Messages(unsigned seed) : random_(seed) {}
  double normal() { return 100.0 * normal_(random_); }
  double queue(double mean) { return mean * exponential_(random_); }
  /// Of which one in ten is late by 100 us.
  double spiked() { return normal() + (uniform_(random_) < 0.1 ? 100e3 : 0.0); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::exponential_distribution<double> exponential_;
  std::uniform_real_distribution<double> uniform_;
};

/// Mean square error against the link, of both filters.
struct Errors {
  double steady = 0.0;
  double median = 0.0;
};
using Exchange = std::function<double(Messages&, int)>;
using Truth = std::function<double(int)>;

/// RMS in ns over the exchanges from `from` to `to`, of 20 runs.
Errors errors(
    const Exchange& lateness, int from, int to, const Truth& longer = [](int) { return 0.0; }) {
  constexpr int kRuns = 20;
  Errors sum;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    Messages messages(seed);
    DelayFilter steady{{.kind = DelayFilterKind::kSteadyMean}};
    DelayFilter median{{.kind = DelayFilterKind::kMovingMedian}};
    for (int i = 0; i < to; ++i) {
      const double truth = kLink + longer(i);
      const Duration value = Duration::from_ns(truth + lateness(messages, i) / 2.0);
      steady.add(value);
      median.add(value);
      if (i < from) continue;
      sum.steady += std::pow(steady.value().ns() - truth, 2.0);
      sum.median += std::pow(median.value().ns() - truth, 2.0);
    }
  }
  const double count = kRuns * (to - from);
  return {std::sqrt(sum.steady / count), std::sqrt(sum.median / count)};
}

double gaussian(Messages& messages, int /*i*/) { return messages.normal() + messages.normal(); }
double spiked(Messages& messages, int /*i*/) { return messages.spiked() + messages.spiked(); }

TEST(SteadyMean, averages_normal_noise_for_long) {
  const Errors late = errors(gaussian, 600, 1'200);
  EXPECT_LT(late.steady, 4.0);
  EXPECT_GT(late.median, 20.0);
  const Errors early = errors(gaussian, 10, 100);
  EXPECT_LT(early.steady, 0.75 * early.median);
}

TEST(SteadyMean, leaves_out_late_messages_though_one_exchange_in_five_has_one) {
  const Errors late = errors(spiked, 600, 5'000);
  EXPECT_LT(late.steady, 5.0);
  EXPECT_GT(late.median, 1'000.0);
}

TEST(SteadyMean, finds_the_floor_where_messages_are_late_only) {
  const Errors both =
      errors([](Messages& m, int) { return m.queue(100.0) + m.queue(100.0); }, 600, 1'200);
  EXPECT_LT(both.steady, 25.0);
  EXPECT_GT(both.median, 80.0);
  const Errors one =
      errors([](Messages& m, int) { return m.queue(1'000.0) + m.normal(); }, 600, 1'200);
  EXPECT_LT(one.steady, 50.0);
  EXPECT_GT(one.median, 350.0);
}

TEST(SteadyMean, follows_a_link_that_becomes_longer_or_shorter_within_ten_exchanges) {
  for (const double change : {15'000.0, -5'000.0}) {
    const auto longer = [change](int i) { return i < 600 ? 0.0 : change; };
    EXPECT_LT(errors(gaussian, 610, 700, longer).steady, 40.0) << change;
    const Errors clean = errors(gaussian, 600, 1'200, longer);
    EXPECT_LT(clean.steady, 0.95 * clean.median) << change;
    EXPECT_LT(errors(spiked, 640, 700, longer).steady, 100.0) << change;
  }
}

TEST(SteadyMean, follows_changes_within_the_noise) {
  for (const double change : {70.0, 140.0, 210.0, 350.0}) {
    const Errors both =
        errors(gaussian, 600, 1'200, [change](int i) { return i < 600 ? 0.0 : change; });
    EXPECT_LT(both.steady, 1.05 * both.median) << change;
  }
}

TEST(SteadyMean, follows_noise_that_grows_or_shrinks) {
  const auto grows = [](Messages& m, int i) { return gaussian(m, i) * (i < 600 ? 1.0 : 10.0); };
  const auto shrinks = [](Messages& m, int i) { return gaussian(m, i) * (i < 600 ? 10.0 : 1.0); };
  for (const Exchange& noise : {Exchange(grows), Exchange(shrinks)}) {
    const Errors both = errors(noise, 600, 1'200);
    EXPECT_LT(both.steady, both.median);
  }
}

TEST(SteadyMean, averages_values_that_are_medians_themselves) {
  DelayFilter told{{.kind = DelayFilterKind::kMovingMedian}};  // ptp4l's
  DelayFilter steady{{.kind = DelayFilterKind::kSteadyMean}};
  Messages messages(1);
  double sum = 0.0;
  for (int i = 0; i < 10'000; ++i) {
    told.add(Duration::from_ns(kLink + gaussian(messages, i) / 2.0));
    steady.add(told.value());
    if (i >= 2'000) sum += std::pow(steady.value().ns() - kLink, 2.0);
  }
  EXPECT_LT(std::sqrt(sum / 8'000.0), 6.0);
}

TEST(SteadyMean, has_nothing_against_values_that_are_all_alike_or_two) {
  DelayFilter steady{{.kind = DelayFilterKind::kSteadyMean}};
  for (int i = 0; i < 20'000; ++i) {
    steady.add(Duration{Nanoseconds{i % 3 == 0 ? 508 : 500}});
    ASSERT_GE(steady.value(), Duration{Nanoseconds{500}}) << i;
    ASSERT_LE(steady.value(), Duration{Nanoseconds{508}}) << i;
  }
  for (int i = 0; i < 20'000; ++i) steady.add(Duration{Nanoseconds{500}});
  EXPECT_NEAR(steady.value().ns(), 500.0, 0.5);
  for (int i = 0; i < 10; ++i) steady.add(Duration{Nanoseconds{700}});
  EXPECT_EQ(steady.value(), Duration{Nanoseconds{700}});
}

}  // namespace
}  // namespace ftcs
