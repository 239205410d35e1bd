// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "ftcs/daemon/clock_follower.h"
#include "ftcs/daemon/management_client.h"
#include "ftcs/daemon/ptp_port.h"
#include "ftcs/diagnosis/finding.h"
#include "ftcs/platform/local_socket.h"
#include "ftcs/ptp/monitor_source.h"

namespace ftcs::daemon {

/// A clock that follows what another time receiver on this machine measures: timestamps come from
/// the slave_event_monitor socket of ptp4l, which need not steer anything itself (free_running).
class MonitorReceiver final : public PtpPort, private Managed {
 public:
  MonitorReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                  std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts,
                  RealClock* real_clock);

 private:
  [[nodiscard]] std::optional<platform::OsError> open_source() override;
  void wait_until(FreeRunningTime underlying) override;
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] int finish() override;

  [[nodiscard]] Managed* managed() override { return this; }
  [[nodiscard]] ptp::ManagedPort managed_port() override;
  [[nodiscard]] std::string status(const ptp::ManagementCounters& management) override;

  // There is no protocol of our own: nothing comes, nothing is due.
  void start(FreeRunningTime now) override;
  void on_event(std::span<const std::uint8_t>, FreeRunningTime, FreeRunningTime) override {}
  void on_general(std::span<const std::uint8_t>, FreeRunningTime) override {}
  void on_sent(const ptp::EventId&, std::optional<FreeRunningTime>, FreeRunningTime) override {}
  void on_timer(FreeRunningTime) override {}
  void on_link_change(bool, FreeRunningTime) override {}
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const override { return std::nullopt; }

  void read_reports();
  void follow_scale_change();
  void ask_ptp4l(FreeRunningTime now);
  void read_answers(FreeRunningTime now);
  void on_port_data(const ptp::PortDataSet& port, FreeRunningTime now);
  void on_sample(const ptp::MonitorSample& sample);
  void watch_for_silence(FreeRunningTime now);
  void log_lock();
  [[nodiscard]] diagnosis::Finding finding() const;
  [[nodiscard]] ptp::PortState state() const;

  PortFacts facts_;
  std::optional<platform::LocalSocket> socket_{};
  ptp::MonitorSource source_;
  ClockFollower follower_;
  FreeRunningTime last_report_{};
  std::optional<ManagementClient> client_{};
  FreeRunningTime next_scale_question_{};
  std::optional<FreeRunningTime> waits_for_scale_since_{};  ///< samples come and cannot be used
  bool scale_known_ = false;
  FreeRunningTime next_link_question_{};
  bool silent_ = false;          ///< said so
  bool delays_missing_ = false;  ///< said so
  bool was_locked_ = false;
};

/// Asks ptp4l, where it can be reached, which clock its timestamps are readings of and how it
/// measures the delay, and completes the options by that where the user did not say. False: a
/// signal ended it.
[[nodiscard]] bool complete_by_ptp4l(PtpOptions& options, Log& log);

}  // namespace ftcs::daemon
