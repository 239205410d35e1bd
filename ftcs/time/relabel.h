// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>

#include "ftcs/time/instant.h"

namespace ftcs {

/// The same reading under the name of another timescale: epoch and rate stay, nothing is converted.
///
/// Right only where one clock stands in two roles: a steered clock that *is* the reference of
/// somebody below it, simulated time that is the host's own, the first reading that sets a clock.
/// It is spelt out here and nowhere else, so that every such place can be found by this name; two
/// clocks that merely show about the same time are compared with offset_from_reference().
template <class To, class FromTimescale>
[[nodiscard]] constexpr To relabel(Instant<FromTimescale> reading) noexcept {
  static_assert(!std::is_same_v<To, Instant<FromTimescale>>, "nothing to relabel");
  return To{reading.since_epoch()};
}

}  // namespace ftcs
