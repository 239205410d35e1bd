// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "ftcs/daemon/ptp_core_port.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::daemon {

/// A virtual clock that other clocks follow: a grandmaster for the laboratory. Nobody steers it.
class PtpTransmitter final : public PtpCorePort<ptp::TimeTransmitter>, private Managed {
 public:
  PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                 std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts);

 private:
  void act(const ptp::Action& action) override;
  [[nodiscard]] int finish() override;
  [[nodiscard]] Managed* managed() override { return this; }
  [[nodiscard]] ptp::ManagedPort managed_port() override;
  [[nodiscard]] std::string status(const ptp::ManagementCounters& management) override;

  PortFacts facts_;
  std::vector<ptp::PortIdentity> others_{};  ///< who announced themselves too, and were told of
};

}  // namespace ftcs::daemon
