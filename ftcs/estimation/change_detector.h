// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/noise_model.h"

namespace ftcs::estimation {

/// What the last messages allow to believe of a sudden change.
struct ChangeTrust {
  bool sudden = true;        ///< a clock can have brought it; else nothing that one
                             ///< message shows
  bool one_suffices = true;  ///< one message without a second that says the same
  bool seconded = true;      ///< there is such a second
  double least = 0.0;        ///< nats, needed in any case
};

/// Cumulative sums (Page, Biometrika 41, 1954) of log-likelihood ratios between
/// the models of a bank: C_ij = max(0, C_ij + l_j - l_i) for every model j that
/// stands behind i, i.e. is wilder. Beyond the threshold model i has been
/// overtaken by events and takes over the state of the most convincing j; this
/// shortens the memory of calm models at once after a change.
template <class Grid>
class ChangeDetector {
 public:
  static constexpr std::size_t kSize = Grid::kSize;
  static constexpr std::size_t kNone = kSize;
  /// All but the wildest.
  static constexpr std::size_t kRows = kSize - 1;

  /// Bit i: model i may have been overtaken. Only then is take_over(i) worth
  /// asking.
  std::uint32_t add(const std::array<double, kSize>& log_density) noexcept {
    Densities l{};
    for (std::size_t j = 0; j < kWidth; ++j) {
      l[j] = j < kSize ? static_cast<float>(log_density[j]) : kNever;
    }
    std::uint32_t overtaken = 0;
#pragma GCC unroll 32  // where the rows lie is known then
    for (std::size_t i = 0; i < kRows; ++i) {
      overtaken |= static_cast<std::uint32_t>(add_row(i, l)) << i;
    }
    return overtaken;
  }

  struct Takeover {
    std::size_t source = kNone;
    bool alone = false;  ///< for one message's sake
  };

  /// The model that overtakes model i after `count` messages, the last of which
  /// had `log_density`, or kNone. Clears its sums.
  [[nodiscard]] Takeover take_over(std::size_t i, double count,
                                   const std::array<double, kSize>& log_density,
                                   const ChangeTrust& trust) noexcept {
    // Early on every ratio is noisy; the factor keeps the false alarms of the
    // first messages rare.
    const double caution = 1.0 + 16.0 / count;
    const std::size_t winner = most_convincing(i);
    if (winner == kNone) return {};
    const double latest = log_density[winner] - log_density[i];
    if (latest <= 0.0) return {};  // what was put off is over
    const bool abrupt = latest > kHint;
    const double before = static_cast<double>(sum(i, winner)) - latest;
    const bool alone = before < (trust.one_suffices ? kSecond : kHint);
    if (!trust.sudden && (abrupt || winner >= kSudden)) return {};
    if ((alone || (abrupt && !trust.seconded)) && !trust.one_suffices) return {};
    const double enough = (alone ? kConvincing : kThreshold) * caution;
    // What one message hints at must be followed at once; what has gathered over many is more often
    // chance, and costs a calm model all that it knew.
    const double needed = std::max(abrupt ? enough : std::max(enough, kSure), trust.least);
    if (sum(i, winner) <= static_cast<float>(needed)) return {};
    for (std::size_t j = first_of(i); j < kWidth; ++j) sums_[kPlace[i] + j] = 0.0F;
    return {winner, alone};
  }

  /// How far model i is behind the most convincing wilder one, nats.
  [[nodiscard]] double lead(std::size_t i) const noexcept {
    const std::size_t winner = most_convincing(i);
    return winner == kNone ? 0.0 : static_cast<double>(sum(i, winner));
  }

  void clear() noexcept { sums_ = {}; }

 private:
  static constexpr std::size_t kFour = sizeof(Quad) / sizeof(float);
  static constexpr std::size_t kWidth = (kSize + kFour - 1) / kFour * kFour;
  using Densities = std::array<float, kWidth>;

  /// C_ij of all j. True: one is beyond the threshold.
  bool add_row(std::size_t i, const Densities& l) noexcept {
    const float own = l[i];
    float* const row = &sums_[kPlace[i]];
    // Nothing of calmer models in the group of four where the wilder ones begin.
    Quad behind = load<Quad>(&kBehind[kFour - (i + 1) % kFour]);
    Quad peak{};
    for (std::size_t j = first_of(i); j < kWidth; j += kFour) {
      const Quad sum =
          larger<Quad>(Quad{}, load<Quad>(row + j) + (load<Quad>(&l[j]) + behind - own));
      store(row + j, sum);
      peak = larger<Quad>(peak, sum);
      behind = Quad{};
    }
    return any(peak > Quad{} + static_cast<float>(kThreshold));
  }
  [[nodiscard]] float sum(std::size_t i, std::size_t j) const noexcept {
    return sums_[kPlace[i] + j];
  }
  /// Of the models wilder than i, or kNone if none explains better.
  [[nodiscard]] std::size_t most_convincing(std::size_t i) const noexcept {
    std::size_t winner = kNone;
    float furthest = 0.0F;
    for (std::size_t j = i + 1; j < kSize; ++j) {
      if (sum(i, j) > furthest) {
        furthest = sum(i, j);
        winner = j;
      }
    }
    return winner;
  }

  /// Nats. One false alarm per e^9.5 = 13,000 messages and pair of models at
  /// most; measured, with what else is asked of a change: one that mattered in
  /// two million. At ten, stamps that agree to the digit by luck are believed.
  static constexpr double kThreshold = 9.5;
  /// Nats: without so much from those before one message speaks alone.
  static constexpr double kSecond = 2.0;
  static constexpr std::size_t kSudden = Grid::kSudden;

  static constexpr float kNever = -std::numeric_limits<float>::max();
  static_assert(kSize <= 32);
  /// Read from place 4 - n on it spares the first n of a group.
  static constexpr std::array<float, 2 * kFour> kBehind = {kNever, kNever, kNever, kNever,
                                                           0.0F,   0.0F,   0.0F,   0.0F};
  /// A row holds the groups of four from the first that has a wilder model on.
  [[nodiscard]] static constexpr std::size_t first_of(std::size_t i) noexcept {
    return (i + 1) / kFour * kFour;
  }
  /// sums_[kPlace[i] + j] is C_ij.
  static constexpr std::array<std::uint16_t, kRows> kPlace = []() constexpr {
    std::array<std::uint16_t, kRows> place{};
    std::size_t end = 0;
    for (std::size_t i = 0; i < kRows; ++i) {
      place[i] = static_cast<std::uint16_t>(end - first_of(i));
      end += kWidth - first_of(i);
    }
    return place;
  }
  ();
  std::array<float, kPlace[kRows - 1] + kWidth> sums_{};
};

}  // namespace ftcs::estimation
