// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "apps/ftcs/ptp_core_port.h"
#include "apps/ftcs/sample_report.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::app {

/// A virtual clock that follows a PTP time transmitter.
class PtpReceiver final : public PtpCorePort<ptp::TimeReceiver> {
 public:
  PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
              std::unique_ptr<platform::TimestampClock> timestamps,
              const ptp::PortIdentity& identity);

 private:
  ptp::ActionList start(FreeRunningTime now) override;
  void act(const ptp::Action& action) override;
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] int finish() override;

  void on_pair(const EventPair& pair);
  void on_selected(const ptp::TransmitterSelected& selected);
  void report(const SampleRecord& record);
  void report_text(const SampleRecord& record);
  void follow_lock(bool locked);
  [[nodiscard]] std::uint64_t samples_per_summary() const;

  ClockDiscipline discipline_;
  SampleSummary recent_;
  SampleSummary since_lock_;
  bool had_transmitter_ = false;
  bool in_holdover_ = false;
};

}  // namespace ftcs::app
