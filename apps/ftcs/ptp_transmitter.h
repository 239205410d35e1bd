// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "apps/ftcs/ptp_port.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::app {

/// A virtual clock that other clocks follow: a grandmaster for the laboratory. Nobody steers it.
class PtpTransmitter final : public PtpPort {
 public:
  PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
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
  void act(const ptp::Action&) override {}
  [[nodiscard]] int finish() override;

  /// Our clock is the reference.
  [[nodiscard]] ReferenceTime reference_at(FreeRunningTime instant);

  ptp::TimeTransmitter core_;
};

}  // namespace ftcs::app
