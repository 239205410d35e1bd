// SPDX-License-Identifier: MIT
#include "ftcs/daemon/rights.h"

namespace ftcs::daemon {
namespace {

using platform::Confinement;
using platform::SystemCalls;

constexpr std::uint16_t kFirstFreePort = 1024;

}  // namespace

void add_file_rights(Confinement& rights, bool writes) {
  if (writes) rights.capabilities.push_back(CAP_DAC_OVERRIDE);
}

void add_network_rights(Confinement& rights, const PtpOptions& options) {
  const bool raw = options.socket.transport == platform::NetworkTransport::kEthernet;
  const bool low =
      options.socket.event_port < kFirstFreePort || options.socket.general_port < kFirstFreePort;
  if (raw) {
    rights.capabilities.push_back(CAP_NET_RAW);
  } else if (low) {
    rights.capabilities.push_back(CAP_NET_BIND_SERVICE);
  }
  if (options.timestamps != platform::TimestampMode::kSoftware) {
    rights.capabilities.push_back(CAP_NET_ADMIN);  // SIOCSHWTSTAMP
  }
}

/// Metrics and the live page: a web server in threads of its own.
void add_watch_rights(Confinement& rights, const WatchOptions& options) {
  if (!options.is_wanted()) return;
  for (const SystemCalls kind :
       {SystemCalls::kNetwork, SystemCalls::kThreads, SystemCalls::kServer}) {
    rights.calls.push_back(kind);
  }
  for (const auto& address : {options.web, options.metrics}) {
    if (address && address->port != 0 && address->port < kFirstFreePort) {
      rights.capabilities.push_back(CAP_NET_BIND_SERVICE);
    }
  }
  add_file_rights(rights, !options.metrics_file.empty());
}

Confinement rights_of(const PtpOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork};
  const bool asks_ptp4l = options.source == Source::kPtp4l;
  if (!asks_ptp4l) add_network_rights(rights, options);
  if (asks_ptp4l) rights.capabilities.push_back(CAP_CHOWN);  // a socket that it can answer
  if (options.clock.kind != ClockKind::kVirtual) {
    rights.capabilities.push_back(CAP_SYS_TIME);
    rights.calls.push_back(SystemCalls::kSteering);
  }
  if (options.feeds.ntp_shm_unit) rights.calls.push_back(SystemCalls::kSharedMemory);
  if (!options.follower.driftfile.empty()) rights.calls.push_back(SystemCalls::kThreads);
  add_file_rights(rights, !options.follower.driftfile.empty() ||
                              !options.feeds.chrony_socket.empty() ||
                              !options.feeds.time_page.empty());
  add_watch_rights(rights, options.watch);
  return rights;
}

Confinement rights_of(const PhcOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kSteering};
  rights.capabilities = {CAP_SYS_TIME};
  if (options.automatic || options.wait_for_port) rights.capabilities.push_back(CAP_CHOWN);
  add_watch_rights(rights, options.watch);
  return rights;
}

}  // namespace ftcs::daemon
