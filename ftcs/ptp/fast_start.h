// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "ftcs/ptp/wire/identity.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// What is measured before a transmitter is selected: one candidate, the first whose Sync is heard,
/// and its newest pairs. They are worth something only if that candidate is the one selected
/// (decision 0011).
class FastStart {
 public:
  /// Two exchanges: with them a servo knows offset, rate and delay.
  static constexpr std::size_t kCapacity = 4;
  /// A candidate that sends no Sync for so long makes room for another.
  static constexpr Nanoseconds kPatience{4'000'000'000};

  [[nodiscard]] constexpr bool is_candidate(const PortIdentity& port) const noexcept {
    return has_candidate_ && candidate_ == port;
  }
  /// True if a Sync of this port may be measured. `changed`: it is a new candidate, nothing of the
  /// last one is to be mixed with it.
  struct Admission {
    bool admitted = false;
    bool changed = false;
  };
  constexpr Admission admit_sync(const PortIdentity& port, FreeRunningTime now) noexcept {
    const bool known = is_candidate(port);
    if (!known && has_candidate_ && now - last_sync_ <= Duration{kPatience}) return {};
    if (!known) clear();
    has_candidate_ = true;
    candidate_ = port;
    last_sync_ = now;
    return {true, !known};
  }
  /// Keeps the newest ones.
  constexpr void keep(const EventPair& pair) noexcept {
    if (size_ == kCapacity) {
      std::move(pairs_.begin() + 1, pairs_.end(), pairs_.begin());
      --size_;
    }
    pairs_[size_++] = pair;
  }
  constexpr void forget_pairs() noexcept { size_ = 0; }
  constexpr void clear() noexcept {
    has_candidate_ = false;
    size_ = 0;
  }
  [[nodiscard]] constexpr const EventPair* begin() const noexcept { return pairs_.data(); }
  [[nodiscard]] constexpr const EventPair* end() const noexcept { return pairs_.data() + size_; }

 private:
  bool has_candidate_ = false;
  PortIdentity candidate_{};
  FreeRunningTime last_sync_{};
  std::array<EventPair, kCapacity> pairs_{};
  std::size_t size_ = 0;
};

}  // namespace ftcs::ptp
