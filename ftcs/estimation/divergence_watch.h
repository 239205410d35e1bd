// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"

namespace ftcs::estimation {

/// Counts the messages of each direction that nothing believed explains; each
/// that it does explain takes one away. When four of both directions are
/// left (with one outlier in ten, half of them early, once in 10^8 messages at
/// most), and not all of them late, neither outliers nor a longer path nor a
/// host that stood still can be the reason: the filters have diverged, and to
/// start from nothing is quicker than to mend them.
class DivergenceWatch {
 public:
  /// `side`: 0 forward, 1 backward; `early`: before the moment that was
  /// believed.
  void observe(std::size_t side, bool rejected, bool early) noexcept {
    std::uint8_t& left = left_[side];
    if (rejected) {
      left = std::min<std::uint8_t>(static_cast<std::uint8_t>(left + 1), kFew);
      early_ = early_ || early;
      return;
    }
    if (left > 0) --left;
    early_ = early_ && (left_[0] > 0 || left_[1] > 0);
  }
  [[nodiscard]] bool diverged() const noexcept {
    return early_ && left_[0] >= kFew && left_[1] >= kFew;
  }

 private:
  std::array<std::uint8_t, 2> left_{};
  bool early_ = false;
};

}  // namespace ftcs::estimation
