// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/measurement/path_delay_estimator.h"

namespace ftcs {

/// The delay of a link that is measured beside the messages of time (peer delay, IEEE 1588-2019,
/// 11.4): the same filter and the same limits as for an end-to-end path delay. Values come from
/// ptp::PeerDelay, mean = ((t4 - t1) r - (t3 - t2)) / 2. The asymmetry of the configuration is not
/// added: a port's own delayAsymmetry is in the stamps (11.6).
class LinkDelay {
 public:
  explicit LinkDelay(const PathDelayConfig& config) noexcept
      : config_(config), filter_(config.filter) {}

  /// `first`: of another link; what was measured before is void. False if the value is impossible
  /// (below PathDelayConfig::lowest or above highest): it is left out.
  bool add(Duration mean_link_delay, bool first) noexcept {
    if (first) filter_.reset();
    if (mean_link_delay < Duration{config_.lowest} || mean_link_delay > Duration{config_.highest}) {
      return false;
    }
    filter_.add(mean_link_delay);
    return true;
  }
  /// The link is down, or another: not known() until the next value.
  void reset() noexcept { filter_.reset(); }
  [[nodiscard]] bool known() const noexcept { return !filter_.empty(); }
  /// Filtered; zero until known.
  [[nodiscard]] Duration value() const noexcept { return filter_.value(); }

 private:
  PathDelayConfig config_;
  DelayFilter filter_;
};

}  // namespace ftcs
