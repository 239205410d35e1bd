// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "apps/ftcs/clock_follower.h"
#include "apps/ftcs/ptp_core_port.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::app {

/// A clock, virtual or real, that follows a PTP time transmitter.
class PtpReceiver final : public PtpCorePort<ptp::TimeReceiver>, private Managed {
 public:
  PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
              std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts,
              RealClock* real_clock);

 private:
  ptp::ActionList start(FreeRunningTime now) override;
  void act(const ptp::Action& action) override;
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] int finish() override;
  [[nodiscard]] Managed* managed() override { return this; }
  [[nodiscard]] ptp::ManagedPort managed_port() override;
  [[nodiscard]] std::string status(const ptp::ManagementCounters& management) override;

  void on_pair(const EventPair& pair);
  void on_selected(const ptp::TransmitterSelected& selected);
  void follow_scale_change();
  void follow_lock(bool locked);
  /// True if there was something to say.
  bool log_missing(LogLevel level);

  ClockFollower follower_;
  bool had_transmitter_ = false;
  bool looked_for_missing_ = false;
  PortFacts facts_;
};

}  // namespace ftcs::app
