// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "ftcs/daemon/ptp_core_port.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::daemon {

/// A virtual clock that other clocks follow: a grandmaster for the laboratory. Nobody steers it.
class PtpTransmitter final : public PtpCorePort<ptp::TimeTransmitter>, private Managed {
 public:
  PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                 std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts);

 private:
  [[nodiscard]] int finish() override;
  [[nodiscard]] Managed* managed() override { return this; }
  [[nodiscard]] ptp::ManagedPort managed_port() override;
  [[nodiscard]] std::string status(const ptp::ManagementCounters& management) override;

  PortFacts facts_;
};

}  // namespace ftcs::daemon
