// SPDX-License-Identifier: MIT
// World: squared innovations and variances that are given by hand; oracle is
// the formula of the header, written plainly.
#include "ftcs/estimation/evidence.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

constexpr double kScale = 7.0;

/// Weights by the book, of all messages since the start.
template <class Grid>
class Oracle {
 public:
  using Row = typename Evidence<Grid>::Row;

  void add(const Row& distance, const Row& log_variance, double credit) {
    for (std::size_t i = 0; i < Grid::kSize; ++i) {
      squares_[i] += credit * std::min(distance[i], 12.0) * kScale * kScale;
      logs_[i] += credit * (log_variance[i] - std::log(kScale * kScale));
    }
    messages_ += credit;
  }
  [[nodiscard]] Row weights() const {
    Row weight{};
    double sum = 0.0;
    for (std::size_t i = 0; i < Grid::kSize; ++i) {
      const double places = static_cast<double>(i) - static_cast<double>(Grid::kStart);
      const double cost = messages_ * std::log(squares_[i] / messages_) + logs_[i] +
                          (places > 0.0 ? 1.0 : 0.3) * places - (i == Grid::kFavoured ? 1.7 : 0.0);
      weight[i] = std::exp(-0.5 * (cost - kReference));
      sum += weight[i];
    }
    for (double& w : weight) w /= sum;
    return weight;
  }

 private:
  static constexpr double kReference = 200.0;  // near the costs below, so that nothing overflows
  Row squares_{};
  Row logs_{};
  double messages_ = 0.0;
};

template <class Grid>
void expect_weights_of_the_formula() {
  using Row = typename Evidence<Grid>::Row;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> distance(0.0, 3.0);
  std::uniform_real_distribution<double> variance(40.0, 60.0);
  Evidence<Grid> evidence;
  Oracle<Grid> oracle;
  for (int n = 0; n < 60; ++n) {
    Row distances{};
    Row log_variances{};
    for (std::size_t i = 0; i < Grid::kSize; ++i) {
      distances[i] = distance(random);
      log_variances[i] = std::log(variance(random));
    }
    const double credit = n % 5 == 0 ? 0.3 : 1.0;
    evidence.add(distances, log_variances, credit, kScale);
    oracle.add(distances, log_variances, credit);
    Row weights{};
    const std::size_t best = evidence.weigh(weights);
    const Row wanted = oracle.weights();
    double sum = 0.0;
    for (std::size_t i = 0; i < Grid::kSize; ++i) {
      EXPECT_NEAR(weights[i], wanted[i], 1e-6) << "message " << n << ", model " << i;
      EXPECT_LE(weights[i], weights[best]);
      sum += weights[i];
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
  }
}

TEST(Evidence, weighs_the_models_by_the_likelihood_with_the_scale_profiled_out) {
  expect_weights_of_the_formula<FullGrid>();   // two at a time
  expect_weights_of_the_formula<SmallGrid>();  // an odd number of models: one by
                                               // one
}

TEST(Evidence, one_gross_innovation_counts_no_more_than_its_limit) {
  Evidence<SmallGrid> evidence;
  evidence.add({1e9, 0.0, 0.0}, {}, 1.0, 1.0);
  EXPECT_DOUBLE_EQ(evidence.mean_square(0), 12.0);
}

TEST(Evidence, remembers_four_thousand_messages_and_forgets_all_on_request) {
  Evidence<SmallGrid> evidence;
  for (int n = 0; n < 10'000; ++n) evidence.add({1.0, 1.0, 1.0}, {}, 1.0, 1.0);
  EXPECT_DOUBLE_EQ(evidence.messages(), 4000.0);
  for (int n = 0; n < 4000; ++n) evidence.add({3.0, 3.0, 3.0}, {}, 1.0, 1.0);
  EXPECT_NEAR(evidence.mean_square(0), 3.0 - 2.0 * std::exp(-1.0), 1e-3);
  evidence.forget();
  EXPECT_EQ(evidence.messages(), 0.0);
}

TEST(QuickMath, logarithm_and_exponential_agree_with_the_library_in_every_lane) {
  for (double x = 1e-300; x < 1e300; x *= 1.37) {
    EXPECT_NEAR(quick_log(x), std::log(x), 1e-8) << x;
    const Pair both = quick_log(Pair{x, 1.0});
    EXPECT_EQ(both[0], quick_log(x));
    EXPECT_EQ(both[1], 0.0);
  }
  for (double x = -700.0; x <= 700.0; x += 0.173) {
    EXPECT_NEAR(quick_exp(x) / std::exp(x), 1.0, 1e-8) << x;
    const Pair both = quick_exp(Pair{0.0, x});
    EXPECT_EQ(both[0], 1.0);
    EXPECT_EQ(both[1], quick_exp(x));
  }
}

TEST(Lanes, selections_take_the_first_of_equal_or_incomparable_values) {
  const double nothing = std::nan("");
  EXPECT_EQ(larger(0.0, nothing), 0.0);
  EXPECT_EQ(lesser(1.0, nothing), 1.0);
  const Pair most = larger(Pair{0.0, 2.0}, Pair{nothing, 1.0});
  EXPECT_EQ(most[0], 0.0);
  EXPECT_EQ(most[1], 2.0);
  EXPECT_EQ(largest(Pair{1.0, 4.0}), 4.0);
  EXPECT_EQ(least(Pair{1.0, 4.0}), 1.0);
  EXPECT_EQ(total(Pair{1.0, 4.0}), 5.0);
  EXPECT_EQ(magnitude(Pair{-1.0, 4.0})[0], 1.0);
  EXPECT_TRUE(any(Pair{1.0, 0.0} > Pair{2.0, -1.0}));
  EXPECT_FALSE(any(Pair{1.0, 0.0} > Pair{2.0, 1.0}));
}

}  // namespace
}  // namespace ftcs::estimation
