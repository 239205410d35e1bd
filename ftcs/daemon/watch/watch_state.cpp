// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/watch_state.h"

#include <cmath>

namespace ftcs::daemon {

std::string_view name(WatchMode mode) noexcept {
  constexpr std::array<std::string_view, kWatchModes> kNames{"freerun", "acquiring", "locked",
                                                             "holdover"};
  return kNames[static_cast<std::size_t>(mode)];
}

double measured_offset_ns(const WatchState& state) noexcept {
  return state.mode == WatchMode::kHoldover ? WatchState::kUnknown : state.offset_ns;
}

double offset_bound_ns(const WatchState& state) noexcept {
  constexpr double kSigmas = 3.0;
  const double delay = std::isnan(state.delay_ns) ? 0.0 : std::abs(state.delay_ns);
  return std::abs(state.offset_ns) + kSigmas * state.sigma_ns + delay;
}

}  // namespace ftcs::daemon
