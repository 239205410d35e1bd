// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/rights.h"

#include "ftcs/daemon/rights.h"

namespace ftcs::daemon {

using platform::Confinement;
using platform::SystemCalls;

Confinement rights_of(const RunOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kRealTime,
                  SystemCalls::kThreads};
  rights.capabilities = {CAP_SYS_NICE, CAP_IPC_LOCK};
  if (!options.interface.empty()) rights.capabilities.push_back(CAP_NET_RAW);
  if (!options.plant_time.empty() && !options.bridge) {
    rights.calls.push_back(SystemCalls::kSteering);  // clock_adjtime that reads
    add_network_rights(rights, options.ptp);
  }
  add_file_rights(rights, !options.json.empty() || !options.csv.empty() || !options.html.empty());
  add_watch_rights(rights, options.watch);
  return rights;
}

Confinement rights_of_segment(bool raw, bool writes_file) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kRealTime};
  rights.capabilities = {CAP_IPC_LOCK};  // memory that is locked grows
  if (raw) rights.capabilities.push_back(CAP_NET_RAW);
  add_file_rights(rights, writes_file);
  return rights;
}

}  // namespace ftcs::daemon
