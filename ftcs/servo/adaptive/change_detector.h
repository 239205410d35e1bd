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
  static constexpr std::size_t kCalm = kSize - Grid::kJumps;
  static constexpr std::size_t kNone = kSize;

  /// Bit i: calm model i may have been overtaken. Only then is take_over(i) worth asking.
  std::uint32_t add(const std::array<double, kSize>& log_density) noexcept {
    std::array<float, kWidth> l{};
    for (std::size_t j = 0; j < kWidth; ++j) {
      l[j] = j < kSize ? static_cast<float>(log_density[j]) : kNever;
    }
    std::uint32_t overtaken = 0;
    const Quad calm_needed = Quad{} + static_cast<float>(kThreshold);
    for (std::size_t i = 0; i < kCalm; ++i) {
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
      const auto alarm =
          (advance(kLast, behind) > load<Quad>(kNeeded.data())) | (peak > calm_needed);
      overtaken |= static_cast<std::uint32_t>(any(alarm)) << i;
    }
    return overtaken;
  }

  /// The model that overtakes calm model i after `count` messages, the last of which had
  /// `log_density`, or kNone. Clears its sums.
  [[nodiscard]] std::size_t take_over(std::size_t i, double count,
                                      const std::array<double, kSize>& log_density) noexcept {
    // Early on every ratio is noisy; the factor keeps the false alarms of the first messages rare.
    const double caution = 1.0 + 16.0 / count;
    std::size_t winner = kNone;
    float furthest = 0.0F;
    for (std::size_t j = i + 1; j < kSize; ++j) {
      const float lead = j < kCalm - 1 ? sums_[i][j] : sums_[i][j] - kHandicap;
      if (lead > furthest) {
        furthest = lead;
        winner = j;
      }
    }
    if (winner == kNone) return kNone;
    // If a jump leads that is not yet certain, a calmer model must not act in its place: wait.
    const bool abrupt = log_density[winner] - log_density[i] > kAbrupt;
    const auto calm_threshold = static_cast<float>(
        abrupt ? kThreshold * caution : std::max(kThreshold * caution, kGradual));
    if (sums_[i][winner] <= (winner < kCalm ? calm_threshold : kJumpThreshold)) return kNone;
    sums_[i].fill(0.0F);
    return winner;
  }

  void clear() noexcept { sums_ = {}; }

 private:
  /// Nats. 11: one false alarm per e^11 = 60,000 messages and pair of models at most (Wald).
  static constexpr double kThreshold = 11.0;
  /// What one message brings a good part of is a change, and must be followed at once; what
  /// has gathered over many is more often chance, and costs a calm model all that it knew.
  static constexpr double kAbrupt = 5.0;
  static constexpr double kGradual = 13.0;
  /// Jumps explain everything for a while; they must be far ahead.
  static constexpr float kJumpThreshold = 30.0F;
  /// Jumps and the wildest frequency model explain anything: Occam's factor against them, nats.
  static constexpr float kHandicap = 4.0F;

  static constexpr std::size_t kFour = 4;
  static constexpr std::size_t kWidth = (kSize + kFour - 1) / kFour * kFour;
  static constexpr float kNever = -1e30F;
  static constexpr std::size_t kLast = kWidth - kFour;  ///< the group of four that has the jumps
  static_assert(kLast <= kCalm && kCalm <= 32);
  /// Read from place 4 - n on it spares the first n of a group.
  static constexpr std::array<float, 2 * kFour> kBehind = {kNever, kNever, kNever, kNever,
                                                           0.0F,   0.0F,   0.0F,   0.0F};
  /// Of the last group.
  static constexpr std::array<float, kFour> kNeeded = [] {
    std::array<float, kFour> needed{};
    for (std::size_t j = 0; j < kFour; ++j) {
      needed[j] = kLast + j < kCalm ? static_cast<float>(kThreshold) : kJumpThreshold;
    }
    return needed;
  }();

  std::array<std::array<float, kWidth>, kCalm> sums_{};
};

}  // namespace ftcs::adaptive
