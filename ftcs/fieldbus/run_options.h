// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/watch/watch.h"
#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/node/cycle_node.h"

namespace ftcs::daemon {

/// A run of `ftcs ethercat`: what the node needs, and what only a host does.
struct RunOptions {
  std::string interface;  ///< raw Ethernet; empty: UDP
  std::string host = "127.0.0.1";
  std::uint16_t port = ethercat::kUdpPort;
  std::size_t drives = 0;  ///< expected at least
  bool take_over = false;  ///< also SubDevices that are in OP
  std::string servo_name = "ftcs";
  CycleServoConfig servo;
  double sync0_phase = 0.5;  ///< SYNC0 comes this part of a cycle after the frame
  std::uint32_t drift_pulses = 15000;
  double duration_s = 10.0;  ///< of the cyclic part; zero: until a signal
  Nanoseconds spin{0};
  int priority = 80;
  int cpu = -1;
  /// 0x10F1:02: a missed SYNC0 window counts three, a good one takes one off. Lost frames of a
  /// shared line shall not fault the drives: six misses in a row do.
  std::uint32_t sync_error_limit = 17;
  /// Frames without an answer, in a row, before all drives are stopped.
  std::uint32_t lost_frame_limit = 10;
  /// So long the cycle may be without its lock, having had it, before all drives are stopped.
  double unlocked_limit_s = 10.0;
  node::LockPolicy lock_policy = node::LockPolicy::kRecovering;
  /// So long the first lock is waited for; zero: for ever.
  double await_lock_s = 0.0;
  /// So long fewer drives than scanned may answer before the rest is stopped.
  double ride_through_s = 0.0;
  bool move = true;          ///< the axes draw circles, two by two
  double radius = 10'000.0;  ///< counts
  double turn_s = 2.0;
  double start_s = 0.0;  ///< instant of plant time at which the circles begin; zero: at once
  /// SYNC signals of single drives, by position on the wire.
  std::array<ethercat::DriveSync, ethercat::kMaxSubDevices> drive_sync{};
  /// |0x092C| above which the clock of a drive counts as off; zero: none does.
  Nanoseconds difference_limit{1'000};
  node::BusMode bus_mode = node::BusMode::kFollow;
  node::BusWrite bus_write = node::BusWrite::kOffset;
  std::string plant_time;  ///< source (open_plant_clock(), or a bridge terminal); empty: none
  std::optional<std::size_t> bridge;  ///< position of the terminal, or bridge::kFirst
  PtpOptions ptp;                     ///< of the source ptp
  double bus_limit_ppm = 400.0;
  double bus_slope_ppm_s = 100.0;
  /// How often the fault of one axis is reset.
  std::uint32_t fault_resets = 0;
  bool contour = false;  ///< drives are the modelled ones: watch the circle of the first two
  bool quiet = false;
  bool trace = true;  ///< keep a point for each of the first half million cycles: histograms, plots
  /// Who asks there with `ftcs status` is answered; empty: nobody is.
  std::string status_socket;
  bool status_socket_given = false;  ///< named by the user: it must be had
  std::string json;
  std::string csv;
  std::string html;
  WatchOptions watch{};  ///< metrics and the live page
};

}  // namespace ftcs::daemon
