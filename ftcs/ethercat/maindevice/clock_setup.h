// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"

namespace ftcs::ethercat {

/// Of the distributed clocks, before the first cycle.
struct ClockSetupConfig {
  /// Drift compensation before the first cycle: so many system times, as fast as frames come back
  /// (ETG.1020 speaks of about 15000).
  std::uint32_t drift_pulses = 15000;
  /// What processing costs beyond forwarding in the SubDevices (compute_propagation_delays).
  Nanoseconds processing_excess{0};
};

/// Appends the datagram that keeps the clocks together during the bring-up, and, where there is
/// room, one that makes the reference stamp this frame: so that another MainDevice sees that one is
/// at work, whatever else is being waited for.
void add_drift(FrameWriter& writer, const Network& network) noexcept;

/// Initialises the distributed clocks: latch, receive times, delays, offsets, drift.
///
/// The reference's system time becomes what the MainDevice's clock showed when it sent the latching
/// frame. For all others:  offset = offset(ref) + local(ref) - local + delay, both latched by one
/// frame: what runs between two reads does not enter.
///
///     latch     BWR 0x0900: each controller keeps the local time at which this frame came
///     read      0x0900 to 0x090F, 0x0918 of each; compute_propagation_delays()
///     write     0x0920 (offset) and 0x0928 (delay) of each, 0x0930 to start its control loop anew
///     drift     FRMW of the reference's 0x0910, drift_pulses times
///
/// A Procedure: request() and reply() in turn; neither waits.
class ClockSetup {
 public:
  void start(const ClockSetupConfig& config) noexcept;
  void request(FrameWriter& writer, const Network& network) noexcept;
  [[nodiscard]] Progress reply(const FrameView& frame, Network& network, FreeRunningTime sent,
                               Failure& failure) noexcept;
  [[nodiscard]] std::uint32_t pulses_left() const noexcept { return pulses_left_; }

 private:
  enum class Step : std::uint8_t { kLatch, kReadTimes, kWriteOffsets, kDrift };
  void next_clock(const Network& network) noexcept;
  void compute(Network& network) noexcept;

  ClockSetupConfig config_;
  Step step_ = Step::kLatch;
  std::size_t device_ = 0;
  FreeRunningTime latched_;
  std::uint32_t pulses_left_ = 0;
};

}  // namespace ftcs::ethercat
