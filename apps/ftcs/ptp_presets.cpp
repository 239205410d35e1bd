// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_presets.h"

#include <span>

#include <fmt/core.h>

#include "apps/ftcs/ptp_option_table.h"

namespace ftcs::app {
namespace {

/// A setting of ptp4l's configuration file.
struct Value {
  const char* name;
  const char* value;
};
struct Preset {
  const char* name;
  std::span<const Value> values;
};

/// IEEE 1588-2019, Annex I.3: the default profile with delay request and response.
constexpr Value kDefaultE2e[] = {
    {"delay_mechanism", "E2E"},      {"domainNumber", "0"},    {"transportSpecific", "0"},
    {"logAnnounceInterval", "1"},    {"logSyncInterval", "0"}, {"logMinDelayReqInterval", "0"},
    {"announceReceiptTimeout", "3"}, {"priority1", "128"},     {"priority2", "128"},
};

/// IEEE 1588-2019, Annex I.4: the default profile with peer delay.
constexpr Value kDefaultP2p[] = {
    {"delay_mechanism", "P2P"},      {"domainNumber", "0"},    {"transportSpecific", "0"},
    {"logAnnounceInterval", "1"},    {"logSyncInterval", "0"}, {"logMinPdelayReqInterval", "0"},
    {"announceReceiptTimeout", "3"}, {"priority1", "128"},     {"priority2", "128"},
};

/// IEEE 802.1AS-2020: an end station on full-duplex Ethernet (Clause 11), domain 0. The values are
/// those of 8.6.2 (priorities), 10.7 (intervals, timeouts) and 11.2.2 (800 ns), and of linuxptp's
/// gPTP.cfg.
constexpr Value kGptp[] = {
    {"network_transport", "L2"},
    {"ptp_dst_mac", "01:80:C2:00:00:0E"},
    {"p2p_dst_mac", "01:80:C2:00:00:0E"},
    {"delay_mechanism", "P2P"},
    {"transportSpecific", "1"},
    {"domainNumber", "0"},
    {"logAnnounceInterval", "0"},
    {"logSyncInterval", "-3"},
    {"logMinPdelayReqInterval", "0"},
    {"announceReceiptTimeout", "3"},
    {"syncReceiptTimeout", "3"},
    {"neighborPropDelayThresh", "800"},
    {"min_neighbor_prop_delay", "-20000000"},
    {"assume_two_step", "1"},
    {"follow_up_info", "1"},
    {"path_trace_enabled", "1"},
    {"priority1", "248"},
    {"priority2", "248"},
};

constexpr Preset kPresets[] = {
    {"default-e2e", kDefaultE2e}, {"default-p2p", kDefaultP2p}, {"gptp", kGptp}};

}  // namespace

std::string preset_names() {
  std::string names;
  for (const Preset& preset : kPresets) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", preset.name);
  }
  return names;
}

std::optional<std::string> apply_preset(daemon::PtpOptions& options, std::string_view name) {
  for (const Preset& preset : kPresets) {
    if (name != preset.name) continue;
    for (const Value& value : preset.values) {
      if (auto wrong = apply_setting(options, value.name, value.value)) return wrong;
    }
    return std::nullopt;
  }
  return fmt::format("unknown preset '{}' (known: {})", name, preset_names());
}

}  // namespace ftcs::app
