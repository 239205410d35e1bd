// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "apps/ftcs/ptp_core_port.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::app {

/// A virtual clock that other clocks follow: a grandmaster for the laboratory. Nobody steers it.
class PtpTransmitter final : public PtpCorePort<ptp::TimeTransmitter> {
 public:
  PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                 std::unique_ptr<platform::TimestampClock> timestamps,
                 const ptp::PortIdentity& identity);

 private:
  void act(const ptp::Action&) override {}
  [[nodiscard]] int finish() override;
};

}  // namespace ftcs::app
