// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/noise_model.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {

/// What speaks for each model of a bank, the size s of the noise profiled out:
///
///     c_i = W ln(V_i / W) + L_i
///     V = sum of s^2 nu^2 / S,   L = sum of ln(S / s^2),   W messages
///
/// c_i is minus twice the log-likelihood but for a constant: the likelihood of
/// normal innovations of variance k S / s^2, at the k = V / W that makes it
/// largest. Messages count by their credit; the memory grows up to 4,000.
template <class Grid>
class Evidence {
 public:
  static constexpr std::size_t kSize = Grid::kSize;
  using Row = std::array<double, kSize>;

  /// `distance`: nu^2 / S of each model, `log_variance`: ln S, `scale`: s.
  void add(const Row& distance, const Row& log_variance, double credit, double scale) noexcept {
    const double s2 = scale * scale;
    const double log_s2 = quick_log(s2);
    const V limit = V{} + kLimit;
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V square = credit * lesser(load<V>(&distance[i]), limit) * s2;
      store(&squares_[i], load<V>(&squares_[i]) + square);
      store(&logs_[i], load<V>(&logs_[i]) + credit * (load<V>(&log_variance[i]) - log_s2));
    }
    messages_ += credit;
    if (messages_ > kLongestMemory) shrink();
  }
  void forget() noexcept { *this = Evidence{}; }
  /// What another bank has heard of the same models, which stand there at
  /// places[i].
  template <class Other>
  void take_from(const Evidence<Other>& other,
                 const std::array<std::size_t, kSize>& places) noexcept {
    messages_ = other.messages_;
    for (std::size_t i = 0; i < kSize; ++i) {
      squares_[i] = other.squares_[places[i]];
      logs_[i] = other.logs_[places[i]];
    }
  }

  /// W.
  [[nodiscard]] double messages() const noexcept { return messages_; }
  /// V_i / W: the squared noise that model i sees, ns^2. Valid: messages() > 0.
  [[nodiscard]] double mean_square(std::size_t i) const noexcept { return squares_[i] / messages_; }

  /// Writes the models' weights exp(-c_i / 2), sum one, and returns the
  /// heaviest. Valid: messages() > 0.
  [[nodiscard]] std::size_t weigh(Row& weight) const noexcept {
    Row cost;
    const double per_message = 1.0 / messages_;
    const V smallest = V{} + std::numeric_limits<double>::min();
    V lowest = V{} + std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V square = larger<V>(load<V>(&squares_[i]) * per_message, smallest);
      const V c = messages_ * quick_log(square) + load<V>(&logs_[i]) + load<V>(&kPlaceCost[i]);
      store(&cost[i], c);
      lowest = lesser(lowest, c);
    }
    const double best_cost = least(lowest);
    V sum{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V behind = 0.5 * (load<V>(&cost[i]) - best_cost);
      V w{};
      if (least(behind) < kBeyondDoubt) w = behind < kBeyondDoubt ? quick_exp(V{} - behind) : w;
      store(&weight[i], w);
      sum += w;
    }
    scale_to_one(weight, total(sum));
    std::size_t heaviest = 0;
    while (heaviest < kSize && cost[heaviest] != best_cost) ++heaviest;
    return heaviest < kSize ? heaviest : 0;  // no cost is a number
  }

  /// Writes weights that lean to the wilder models, for the deviation: w_i times kLean for each
  /// model that is calmer, sum one. Which of two models that explain the messages alike is right
  /// cannot be told, and the calmer one is the better bet for the mean; the deviation answers for
  /// the other. (The floor's calmest stands for several, and weighs as its neighbour does.)
  static void lean(const Row& weight, Row& leaning) noexcept {
    V sum{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V w = load<V>(&weight[i]) * load<V>(&kLeaning[i]);
      store(&leaning[i], w);
      sum += w;
    }
    scale_to_one(leaning, total(sum));
  }

 private:
  template <class Other>
  friend class Evidence;
  using V = typename LanesOf<kSize>::Type;
  static constexpr std::size_t kStep = kLanes<V>;

  static void scale_to_one(Row& weight, double sum) noexcept {
    const double share = 1.0 / sum;
    for (std::size_t i = 0; i < kSize; i += kStep) store(&weight[i], load<V>(&weight[i]) * share);
  }
  void shrink() noexcept {
    const double keep = kLongestMemory / messages_;
    messages_ = kLongestMemory;
    for (std::size_t i = 0; i < kSize; i += kStep) {
      store(&squares_[i], load<V>(&squares_[i]) * keep);
      store(&logs_[i], load<V>(&logs_[i]) * keep);
    }
  }

  /// One innovation, normalised and squared, counts at most this much.
  static constexpr double kLimit = 12.0;
  /// Twice nats per place behind the starting model: with three messages every
  /// model is as likely as the next, and the wildest would take the noise for
  /// motion. Forgotten after a dozen messages.
  static constexpr double kWildnessCost = 1.0;
  /// And before it: how slowly an oscillator wanders shows only after thousands
  /// of messages; until then the calmer of two models that explain the same is
  /// the better bet. More than this costs oscillators that do wander slowly.
  static constexpr double kCalmGain = 0.3;
  /// Twice nats for the one model of a slow wander that is too fast for the
  /// five nearly constant ones to stand in for it, and whose own neighbours
  /// cost 10 to 40 %: against their number.
  static constexpr double kFavour = 1.7;
  static constexpr Row kPlaceCost = []() constexpr {
    Row row{};
    for (std::size_t i = 0; i < kSize; ++i) {
      const double places = Grid::places_from_start(i);
      row[i] = (places > 0.0 ? kWildnessCost : kCalmGain) * places;
      if (i == Grid::kFavoured) row[i] -= kFavour;
      if (i == 0) row[i] -= Grid::kCalmFavour;
    }
    return row;
  }
  ();

  /// Each model against the calmer one beside it. Where a wander is just too slow to be seen, 3
  /// sigma held 96 to 98 % of the errors without it.
  static constexpr double kLean = 1.7;
  static constexpr Row kLeaning = []() constexpr {
    Row row{};
    row[0] = Grid::kCalmFavour > 0.0 ? kLean : 1.0;
    row[1] = kLean;
    for (std::size_t i = 2; i < kSize; ++i) row[i] = kLean * row[i - 1];
    return row;
  }
  ();

  Row squares_{};
  Row logs_{};
  double messages_ = 0.0;
};

}  // namespace ftcs::estimation
