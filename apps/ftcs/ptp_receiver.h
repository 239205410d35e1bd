// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "apps/ftcs/ptp_port.h"
#include "apps/ftcs/sample_report.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::app {

/// A virtual clock that follows a PTP time transmitter.
class PtpReceiver final : public PtpPort {
 public:
  PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
              std::unique_ptr<platform::TimestampClock> timestamps,
              const ptp::PortIdentity& identity);

 private:
  ptp::ActionList start(FreeRunningTime now) override;
  ptp::ActionList on_event(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                           FreeRunningTime now) override;
  ptp::ActionList on_general(std::span<const std::uint8_t> bytes, FreeRunningTime now) override;
  ptp::ActionList on_sent(std::uint16_t sequence_id, std::optional<FreeRunningTime> sent,
                          FreeRunningTime now) override;
  ptp::ActionList on_timer(FreeRunningTime now) override;
  ptp::ActionList on_link_change(bool up, FreeRunningTime now) override;
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const override;
  void act(const ptp::Action& action) override;
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] int finish() override;

  void on_pair(const EventPair& pair);
  void on_selected(const ptp::TransmitterSelected& selected);
  void report(const SampleRecord& record);
  void report_text(const SampleRecord& record);
  void follow_lock(bool locked);
  [[nodiscard]] std::uint64_t samples_per_summary() const;

  ptp::TimeReceiver core_;
  ClockDiscipline discipline_;
  SampleSummary recent_;
  SampleSummary since_lock_;
  bool had_transmitter_ = false;
  bool in_holdover_ = false;
};

}  // namespace ftcs::app
