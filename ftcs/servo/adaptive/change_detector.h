// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/servo/adaptive/lanes.h"
#include "ftcs/servo/adaptive/noise_model.h"

namespace ftcs::adaptive {

/// Cumulative sums (Page, Biometrika 41, 1954) of log-likelihood ratios between the models of a
/// bank: C_ij = max(0, C_ij + l_j - l_i) for every model j that stands behind i, i.e. is wilder.
/// Beyond the threshold model i has been overtaken by events and takes over the state of the most
/// convincing j; this shortens the memory of calm models at once after a change.
template <class Grid>
class ChangeDetector {
 public:
  static constexpr std::size_t kSize = Grid::kSize;
  static constexpr std::size_t kNone = kSize;
  /// All but the wildest.
  static constexpr std::size_t kRows = kSize - 1;

  /// Bit i: model i may have been overtaken. Only then is take_over(i) worth asking.
  std::uint32_t add(const std::array<double, kSize>& log_density) noexcept {
    std::array<float, kWidth> l{};
    for (std::size_t j = 0; j < kWidth; ++j) {
      l[j] = j < kSize ? static_cast<float>(log_density[j]) : kNever;
    }
    std::uint32_t overtaken = 0;
    const Quad needed = Quad{} + static_cast<float>(kThreshold);
    for (std::size_t i = 0; i < kRows; ++i) {
      const float own = l[i];
      const auto advance = [this, &l, own, i](std::size_t j, const Quad& behind) {
        const Quad sum =
            larger<Quad>(Quad{}, load<Quad>(&sums_[i][j]) + (load<Quad>(&l[j]) + behind - own));
        store(&sums_[i][j], sum);
        return sum;
      };
      std::size_t j = (i + 1) / kFour * kFour;
      // Nothing of calmer models in the group of four where the wilder ones begin.
      Quad behind = load<Quad>(&kBehind[kFour - (i + 1) % kFour]);
      Quad peak{};
      if (j < kLast) {
        peak = advance(j, behind);
        behind = Quad{};
        for (j += kFour; j < kLast; j += kFour) peak = larger<Quad>(peak, advance(j, behind));
      }
      peak = larger<Quad>(peak, advance(kLast, behind));
      overtaken |= static_cast<std::uint32_t>(any(peak > needed)) << i;
    }
    return overtaken;
  }

  /// The model that overtakes model i after `count` messages, the last of which had
  /// `log_density`, or kNone. Clears its sums. Without `sudden` nothing that one message shows is
  /// believed.
  [[nodiscard]] std::size_t take_over(std::size_t i, double count,
                                      const std::array<double, kSize>& log_density,
                                      bool sudden) noexcept {
    // Early on every ratio is noisy; the factor keeps the false alarms of the first messages rare.
    const double caution = 1.0 + 16.0 / count;
    const std::size_t winner = most_convincing(i);
    if (winner == kNone) return kNone;
    const double latest = log_density[winner] - log_density[i];
    if (latest <= 0.0) return kNone;  // what was put off is over
    const bool abrupt = latest > kAbrupt;
    const bool alone = static_cast<double>(sums_[i][winner]) - latest < kSecond;
    if (!sudden && (abrupt || winner >= kSudden)) return kNone;
    const double enough = (alone ? kAlone : kThreshold) * caution;
    const double needed = abrupt ? enough : std::max(enough, kGradual);
    if (sums_[i][winner] <= static_cast<float>(needed)) return kNone;
    sums_[i].fill(0.0F);
    return winner;
  }

  /// How far model i is behind the most convincing wilder one, nats.
  [[nodiscard]] double lead(std::size_t i) const noexcept {
    const std::size_t winner = most_convincing(i);
    return winner == kNone ? 0.0 : static_cast<double>(sums_[i][winner]);
  }

  void clear() noexcept { sums_ = {}; }

 private:
  /// Of the models wilder than i, or kNone if none explains better.
  [[nodiscard]] std::size_t most_convincing(std::size_t i) const noexcept {
    std::size_t winner = kNone;
    float furthest = 0.0F;
    for (std::size_t j = i + 1; j < kSize; ++j) {
      if (sums_[i][j] > furthest) {
        furthest = sums_[i][j];
        winner = j;
      }
    }
    return winner;
  }

  /// Nats. One false alarm per e^9.5 = 13,000 messages and pair of models at most (Wald); measured,
  /// with what else is asked of a change: one that mattered in two million.
  static constexpr double kThreshold = 9.5;
  /// What one message brings a good part of is a change, and must be followed at once; what
  /// has gathered over many is more often chance, and costs a calm model all that it knew.
  static constexpr double kAbrupt = 5.0;
  static constexpr double kGradual = 13.0;
  /// What one message says alone, without so much from those before, is now and then the far end of
  /// the noise: five sigma come once in two million.
  static constexpr double kAlone = 11.0;
  static constexpr double kSecond = 2.0;
  /// From here on models explain any single message.
  static constexpr std::size_t kSudden = kSize > 25 ? 25 : kSize;

  static constexpr std::size_t kFour = 4;
  static constexpr std::size_t kWidth = (kSize + kFour - 1) / kFour * kFour;
  static constexpr float kNever = -1e30F;
  static constexpr std::size_t kLast = kWidth - kFour;  ///< the group of four that is never spared
  static_assert(kSize <= 32);
  /// Read from place 4 - n on it spares the first n of a group.
  static constexpr std::array<float, 2 * kFour> kBehind = {kNever, kNever, kNever, kNever,
                                                           0.0F,   0.0F,   0.0F,   0.0F};
  std::array<std::array<float, kWidth>, kRows> sums_{};
};

}  // namespace ftcs::adaptive
