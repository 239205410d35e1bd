// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "ftcs/ptp/wire/identity.h"

namespace ftcs::ptp {

/// The clocks that may be followed, and nobody else (acceptable master table, 17.5). Empty:
/// everybody may. Fixed capacity.
class AcceptableTransmitters {
 public:
  static constexpr std::size_t kCapacity = 16;

  /// False if there is no room.
  constexpr bool add(const ClockIdentity& clock) noexcept {
    if (size_ == kCapacity) return false;
    clocks_[size_++] = clock;
    return true;
  }
  [[nodiscard]] constexpr bool accepts(const ClockIdentity& clock) const noexcept {
    const auto* const end = clocks_.data() + size_;
    return size_ == 0 || std::find(clocks_.data(), end, clock) != end;
  }

 private:
  std::array<ClockIdentity, kCapacity> clocks_{};
  std::size_t size_ = 0;
};

}  // namespace ftcs::ptp
