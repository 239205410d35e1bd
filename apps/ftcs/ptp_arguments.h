// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "apps/ftcs/epoch_arguments.h"
#include "apps/ftcs/rights.h"
#include "apps/ftcs/steering_arguments.h"
#include "ftcs/daemon/ptp_options.h"

namespace ftcs::app {

/// The command line as it was given: a configuration file is read first, the command line wins.
struct PtpArguments {
  std::vector<std::string> interfaces;
  std::string config_file;
  std::vector<std::pair<std::string, std::string>> settings;  ///< ptp4l's names
  bool receiver_only = false;
  bool hardware = false;
  bool software = false;
  std::string role;
  std::string source;
  std::string ptp4l_socket;
  std::string chrony_socket;
  std::string time_page;
  std::optional<int> ntp_shm_unit;
  SteeringArguments steering;
  RightsArguments rights;
  EpochArguments epoch;
  std::optional<double> offset_gain;
  std::string converged_band;
  std::optional<std::uint32_t> converged_dwell;
  std::string correction_time;
  std::string clock = "virtual";
  std::string offset;
  std::string skew;
  bool first_step = false;
  bool json = false;
  bool csv = false;
  std::optional<std::uint16_t> event_port;
  std::optional<std::uint16_t> general_port;
  std::string unicast;
  std::string preset;
  std::vector<std::string> acceptable;
  bool no_fast_start = false;
  std::optional<double> duration_s;
  daemon::WatchOptions watch{};
};

/// The flags of `ftcs ptp`: ptp4l's, our own, and every setting of ptp4l's configuration file.
/// `arguments` must outlive `command`.
void add_ptp_arguments(CLI::App& command, PtpArguments& arguments);

/// Reads the keys that `spp` asks for, while every right to read them is still there. Options that
/// come from a configuration file alone need it as well. Returns what is wrong, or nothing.
[[nodiscard]] std::optional<std::string> open_keys(daemon::PtpOptions& options);

/// The options that those arguments ask for. Returns what is wrong with them, or nothing.
[[nodiscard]] std::optional<std::string> make_ptp_options(const PtpArguments& arguments,
                                                          daemon::PtpOptions& options);

}  // namespace ftcs::app
