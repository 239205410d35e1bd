// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ftcs/analysis/stability.h"
#include "ftcs/daemon/watch/watch_state.h"

namespace ftcs::daemon {

enum class MetricsNames : std::uint8_t {
  kFtcs,       ///< ftcs_..., base units
  kOpenShift,  ///< openshift_ptp_..., as dashboards of that platform read them
};
enum class MetricsFormat : std::uint8_t { kPrometheus, kOpenMetrics };

struct MetricsInput {
  const WatchState& state;
  double largest_offset_ns = 0.0;  ///< of the last minutes
  const std::vector<StabilityPoint>& tdev;
};

/// The exposition: Prometheus's text format 0.0.4, or OpenMetrics 1.0. What is not known is left
/// out. docs/service.md lists the names.
[[nodiscard]] std::string metrics_text(const MetricsInput& input, MetricsNames names,
                                       MetricsFormat format);
/// The header Content-Type of each.
[[nodiscard]] std::string metrics_type(MetricsFormat format);

}  // namespace ftcs::daemon
