// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_fixed_settings.h"

#include <algorithm>
#include <array>

#include <fmt/core.h>

namespace ftcs::app {
namespace {

// What describes this program anyway, so that files written for ptp4l need no editing; kAny: no
// effect here.
struct Fixed {
  const char* name;
  const char* value;
};
constexpr const char* kAny = "*";
constexpr std::array kFixed{
    Fixed{"twoStepFlag", "1"},
    Fixed{"gmCapable", "1"},
    Fixed{"socket_priority", "0"},
    Fixed{"freq_est_interval", kAny},  // free_running has no estimator of its own
    Fixed{"dscp_event", "0"},
    Fixed{"dscp_general", "0"},
    Fixed{"dataset_comparison", "ieee1588"},
    Fixed{"G.8275.defaultDS.localPriority", "128"},
    Fixed{"G.8275.portDS.localPriority", "128"},
    Fixed{"maxStepsRemoved", "255"},
    Fixed{"operLogSyncInterval", kAny},       // automotive profile only
    Fixed{"operLogPdelayReqInterval", kAny},  // automotive profile only
    Fixed{"fault_reset_interval", kAny},      // the port comes back by itself
    Fixed{"BMCA", "ptp"},
    Fixed{"inhibit_announce", "0"},
    Fixed{"inhibit_delay_req", "0"},
    Fixed{"ignore_source_id", "0"},
    Fixed{"ignore_transport_specific", "0"},
    Fixed{"inhibit_multicast_service", "0"},
    Fixed{"net_sync_monitor", "0"},
    Fixed{"tc_spanning_tree", "0"},
    Fixed{"unicast_listen", "0"},
    Fixed{"unicast_master_table", "0"},
    Fixed{"unicast_req_duration", kAny},  // unicast negotiation only
    Fixed{"use_syslog", kAny},            // messages go to standard output
    Fixed{"verbose", kAny},
    Fixed{"check_fup_sync", "0"},
    Fixed{"sanity_freq_limit", kAny},  // RAW is the estimator's clock: nothing to check against
    Fixed{"ntpshm_segment", "0"},
    Fixed{"msg_interval_request", "0"},
    Fixed{"servo_num_offset_values", kAny},  // of servo_offset_threshold only
    Fixed{"servo_offset_threshold", "0"},
    Fixed{"write_phase_mode", "0"},
    Fixed{"step_window", "0"},
    Fixed{"uds_ro_address", kAny},
    Fixed{"clock_type", "OC"},
    Fixed{"tsproc_mode", "filter"},
    Fixed{"boundary_clock_jbod", "0"},
    Fixed{"productDescription", kAny},  // management only
    Fixed{"revisionData", kAny},
    Fixed{"manufacturerIdentity", kAny},
    Fixed{"userDescription", kAny},
};

const Fixed* find(std::string_view name) {
  const auto* const found =
      std::ranges::find_if(kFixed, [&](const Fixed& fixed) { return name == fixed.name; });
  return found == kFixed.end() ? nullptr : found;
}

}  // namespace

std::vector<std::string> fixed_setting_names() {
  std::vector<std::string> names(kFixed.size());
  std::ranges::transform(kFixed, names.begin(), &Fixed::name);
  return names;
}

bool is_fixed_setting(std::string_view name) { return find(name) != nullptr; }

std::optional<std::string> check_fixed_setting(std::string_view name, std::string_view value) {
  const Fixed* const fixed = find(name);
  if (std::string_view{fixed->value} == kAny || value == fixed->value) return std::nullopt;
  return fmt::format("{}: '{}' is not supported, only {}", name, value, fixed->value);
}

}  // namespace ftcs::app
