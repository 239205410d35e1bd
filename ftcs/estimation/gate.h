// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/divergence_watch.h"

namespace ftcs::estimation {

/// Learns how often the messages of each direction (0 forward, 1 backward) are
/// outliers, and tells when there are too many in a row to be that: the gate
/// opens.
class Gate {
 public:
  enum class Verdict : std::uint8_t {
    kShut,
    kOpen,       ///< what was believed of this direction is in doubt
    kOpenAlone,  ///< the same, and this message is to be heard once more: the
                 ///< other direction fits
    kDiverged,   ///< nothing is as believed
  };
  /// Exponential mean of what was not believed.
  void learn(std::size_t side, double credit) noexcept {
    double& late = late_outliers_[side];
    late = std::clamp(late + ((1.0 - credit) - late) / kOutlierMemory, kSeldom, kOften);
  }
  [[nodiscard]] double late_outliers(std::size_t side) const noexcept {
    return late_outliers_[side];
  }
  /// Rejections in a row of the direction that has more.
  [[nodiscard]] int most_rejected() const noexcept { return std::max(rejected_[0], rejected_[1]); }

  /// `credit`: probability that the message is no outlier. `since_change`:
  /// messages since a change was followed.
  [[nodiscard]] Verdict observe(std::size_t side, double credit, bool early,
                                std::uint32_t since_change) noexcept {
    std::uint8_t& rejected = rejected_[side];
    std::uint8_t& taken = taken_[side];
    divergence_.observe(side, credit < kUnlikely, early);
    if (credit >= kUnlikely) {
      rejected = 0;
      taken = std::min<std::uint8_t>(static_cast<std::uint8_t>(taken + 1), kLately);
      return Verdict::kShut;
    }
    if (divergence_.diverged()) return Verdict::kDiverged;
    ++rejected;
    const bool alone = rejected_[1 - side] == 0;  // a host that stands still makes both late
    // So many cannot all be outliers, fewer where a change has just been followed; nor can more
    // than were ever taken.
    const std::uint8_t enough = alone && since_change < kShortMemory ? kRepeated : kLately;
    if (rejected < std::max(kFew, std::min(enough, taken))) return Verdict::kShut;
    const bool certain = alone && rejected >= enough;
    rejected = 0;
    divergence_ = {};
    return certain ? Verdict::kOpenAlone : Verdict::kOpen;
  }
  /// A jump was followed: it explains what was unexplained before it.
  void explained() noexcept { divergence_ = {}; }

 private:
  std::array<double, 2> late_outliers_ = {kNowAndThen, kNowAndThen};
  std::array<std::uint8_t, 2> rejected_{};  ///< in a row
  std::array<std::uint8_t, 2> taken_{};     ///< up to as many as would open the gate
  DivergenceWatch divergence_{};
};

}  // namespace ftcs::estimation
