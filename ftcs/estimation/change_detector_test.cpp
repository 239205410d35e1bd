// SPDX-License-Identifier: MIT
// World: log densities per message; index 0 is the calmest model.
#include "ftcs/estimation/change_detector.h"

#include <array>
#include <random>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

using Detector = ChangeDetector<FullGrid>;
using Densities = std::array<double, Detector::kSize>;
constexpr ChangeTrust kTrusted{};
constexpr ChangeTrust kNotSudden{false, true};
constexpr double kLater = 1000.0;  // messages seen: the threshold is at its final value

TEST(ChangeDetector, one_message_alone_takes_over_only_where_one_suffices) {
  for (const bool suffices : {true, false}) {
    Detector detector;
    Densities l{};
    l[20] = 12.0;
    detector.add(l);
    const auto first = detector.take_over(5, kLater, l, {true, suffices});
    EXPECT_EQ(first.source, suffices ? 20U : Detector::kNone);
    EXPECT_EQ(first.alone, suffices);
    detector.add(l);
    EXPECT_EQ(detector.take_over(5, kLater, l, {true, false}).alone, false);
  }
}

TEST(ChangeDetector, a_wilder_model_that_explains_more_takes_over) {
  Detector detector;
  Densities l{};
  l[20] = 4.0;
  for (int i = 0; i < 3; ++i) {
    detector.add(l);
    EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, Detector::kNone);
  }
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 20U);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, Detector::kNone)
      << "sums start anew";
}

TEST(ChangeDetector, one_message_that_says_most_decides_sooner_than_many) {
  Detector detector;
  Densities l{};
  l[20] = 2.5;
  detector.add(l);
  l[20] = 9.5;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 20U)
      << "12 nats, 9.5 of them at once";
  l[20] = 4.0;
  for (int i = 0; i < 3; ++i) detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, Detector::kNone)
      << "12 nats by and by";
}

TEST(ChangeDetector, what_was_put_off_is_over_when_the_latest_message_says_otherwise) {
  Detector detector;
  Densities l{};
  l[20] = 20.0;
  detector.add(l);
  l[20] = -1.0;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, Detector::kNone);
  l[20] = 0.5;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 20U);
}

TEST(ChangeDetector, a_calmer_model_never_takes_over) {
  Detector detector;
  Densities l{};
  l[2] = 50.0;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, Detector::kNone);
}

TEST(ChangeDetector, what_one_message_shows_can_be_forbidden) {
  Detector detector;
  Densities l{};
  l[20] = 12.0;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kNotSudden).source, Detector::kNone);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 20U);
  l[20] = 0.0;
  l[26] = 4.0;  // explains any message
  for (int i = 0; i < 5; ++i) detector.add(l);
  EXPECT_EQ(detector.take_over(5, kLater, l, kNotSudden).source, Detector::kNone);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 26U);
}

TEST(ChangeDetector, evidence_must_come_in_a_row) {
  Detector detector;
  Densities good{};
  Densities bad{};
  good[20] = 6.0;
  bad[20] = -6.0;
  for (int i = 0; i < 100; ++i) {
    detector.add(good);
    detector.add(bad);
    ASSERT_EQ(detector.take_over(5, kLater, bad, kTrusted).source, Detector::kNone);
  }
}

TEST(ChangeDetector, early_on_it_asks_for_more) {
  Detector detector;
  Densities l{};
  l[20] = 20.0;
  detector.add(l);
  EXPECT_EQ(detector.take_over(5, 8.0, l, kTrusted).source, Detector::kNone);
  EXPECT_EQ(detector.take_over(5, kLater, l, kTrusted).source, 20U);
}

/// Two models with the same mean and variances 1 and 1.2, data from the first:
/// exp(14) messages between false alarms is Wald's bound.
TEST(ChangeDetector, false_alarms_are_rare) {
  Detector detector;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  int alarms = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double n = normal(random);
    Densities l;
    l.fill(-0.5 * n * n);
    l[20] = -0.5 * n * n / 1.2 - 0.5 * 0.1823;
    detector.add(l);
    if (detector.take_over(0, kLater, l, kTrusted).source != Detector::kNone) ++alarms;
  }
  EXPECT_LE(alarms, 2);
}

}  // namespace
}  // namespace ftcs::estimation
