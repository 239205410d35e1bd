// SPDX-License-Identifier: MIT
#include "apps/ftcs/rights.h"

#include <linux/capability.h>

#include <CLI/CLI.hpp>

namespace ftcs::app {
namespace {

using platform::Confinement;
using platform::SystemCalls;

constexpr std::uint16_t kFirstFreePort = 1024;

/// Files of other users' folders, as long as we are root.
void write_files(Confinement& rights, bool writes) {
  if (writes) rights.capabilities.push_back(CAP_DAC_OVERRIDE);
}

void use_network(Confinement& rights, const daemon::PtpOptions& options) {
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
void be_watched(Confinement& rights, const daemon::WatchOptions& options) {
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
  write_files(rights, !options.metrics_file.empty());
}

}  // namespace

Confinement rights_of(const daemon::PtpOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork};
  const bool asks_ptp4l = options.source == daemon::Source::kPtp4l;
  if (!asks_ptp4l) use_network(rights, options);
  if (asks_ptp4l) rights.capabilities.push_back(CAP_CHOWN);  // a socket that it can answer
  if (options.clock != daemon::ClockKind::kVirtual) {
    rights.capabilities.push_back(CAP_SYS_TIME);
    rights.calls.push_back(SystemCalls::kSteering);
  }
  if (options.ntp_shm_unit) rights.calls.push_back(SystemCalls::kSharedMemory);
  if (!options.driftfile.empty()) rights.calls.push_back(SystemCalls::kThreads);
  write_files(rights, !options.driftfile.empty() || !options.chrony_socket.empty() ||
                          !options.time_page.empty());
  be_watched(rights, options.watch);
  return rights;
}

Confinement rights_of(const daemon::PhcOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kSteering};
  rights.capabilities = {CAP_SYS_TIME};
  if (options.automatic || options.wait_for_port) rights.capabilities.push_back(CAP_CHOWN);
  be_watched(rights, options.watch);
  return rights;
}

Confinement rights_of(const daemon::RunOptions& options) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kRealTime,
                  SystemCalls::kThreads};
  rights.capabilities = {CAP_SYS_NICE, CAP_IPC_LOCK};
  if (!options.interface.empty()) rights.capabilities.push_back(CAP_NET_RAW);
  if (!options.plant_time.empty()) {
    rights.calls.push_back(SystemCalls::kSteering);  // clock_adjtime that reads
    use_network(rights, options.ptp);
  }
  write_files(rights, !options.json.empty() || !options.csv.empty() || !options.html.empty());
  be_watched(rights, options.watch);
  return rights;
}

Confinement rights_of_segment(bool raw, bool writes_file) {
  Confinement rights;
  rights.calls = {SystemCalls::kFiles, SystemCalls::kNetwork, SystemCalls::kRealTime};
  rights.capabilities = {CAP_IPC_LOCK};  // memory that is locked grows
  if (raw) rights.capabilities.push_back(CAP_NET_RAW);
  write_files(rights, writes_file);
  return rights;
}

void add_rights_flags(CLI::App& command, RightsArguments& arguments, bool may_change_user) {
  if (may_change_user) {
    command.add_option("--user", arguments.user, "go on as this user once all is open")
        ->type_name("NAME");
  }
  command.add_flag("--unconfined", arguments.unconfined,
                   "keep every right and system call: for debuggers and unusual systems");
}

std::optional<std::string> confine_to(Confinement rights, const RightsArguments& arguments,
                                      std::function<std::optional<std::string>()>* once_open) {
  std::optional<platform::User> user;
  if (!arguments.user.empty()) {
    user = platform::find_user(arguments.user);
    if (!user) return "--user " + arguments.user + ": no such user";
    std::erase(rights.capabilities, CAP_DAC_OVERRIDE);
    rights.will_change_user = true;
  }
  if (user && once_open != nullptr) {
    *once_open = [user = *user, capabilities = rights.capabilities] {
      return platform::become_user(user, capabilities);
    };
  }
  if (arguments.unconfined) return std::nullopt;
  return platform::confine(rights);
}

}  // namespace ftcs::app
