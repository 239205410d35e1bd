// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/clock/wide.h"
#include "ftcs/time/instant.h"

namespace ftcs::addend_test {

/// Time in 2^-32 ns.
using Fine = Int128;
constexpr Fine kFineNs = Fine{1} << 32;

[[nodiscard]] inline Duration duration_of(Fine fine) {
  return Duration::from_parts(static_cast<std::int64_t>(fine >> 32),
                              static_cast<std::uint32_t>(fine));
}

/// floor(a / b), b > 0.
[[nodiscard]] inline Fine floor_divide(Fine a, Fine b) {
  const Fine quotient = a / b;
  return a % b < 0 ? quotient - 1 : quotient;
}

/// A clock with an addend register as a straight line between two writes: shown = base + addend /
/// nominal * free running. Exact to 2^-32 ns; the register may be written once more at a reading to
/// come.
class AddendLine {
 public:
  AddendLine(std::uint32_t nominal, Fine free, Fine local)
      : nominal_(nominal), addend_(nominal), free_(free), local_(local) {}

  [[nodiscard]] Fine local_at(Fine free) const {
    if (pending_ && free >= switch_) return line(switch_local_, next_, free - switch_);
    return line(local_, addend_, free - free_);
  }
  /// The first moment at which the clock shows `local`.
  [[nodiscard]] Fine free_at(Fine local) const {
    if (pending_ && local >= switch_local_) return switch_ + inverse(local - switch_local_, next_);
    return free_ + inverse(local - local_, addend_);
  }
  void write(Fine at, std::uint32_t addend) {
    const Fine local = local_at(at);
    free_ = at;
    local_ = local;
    addend_ = addend;
    pending_ = false;
  }
  void write_at_reading(Fine local, std::uint32_t next) {
    switch_ = free_at(local);
    switch_local_ = local;
    next_ = next;
    pending_ = true;
  }
  void step(Fine at, Fine by) {
    write(at, pending_ && at >= switch_ ? next_ : addend_);
    local_ = local_ + by;
  }

 private:
  [[nodiscard]] Fine line(Fine base, std::uint32_t addend, Fine elapsed) const {
    return base + floor_divide(elapsed * addend, nominal_);
  }
  [[nodiscard]] Fine inverse(Fine local, std::uint32_t addend) const {
    return -floor_divide(-local * nominal_, addend);
  }

  std::uint32_t nominal_;
  std::uint32_t addend_;
  Fine free_;
  Fine local_;
  bool pending_ = false;
  Fine switch_ = 0;
  Fine switch_local_ = 0;
  std::uint32_t next_ = 0;
};

}  // namespace ftcs::addend_test
