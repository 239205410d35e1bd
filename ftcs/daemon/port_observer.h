// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "ftcs/daemon/ptp_options.h"
#include "ftcs/diagnosis/port_diagnosis.h"
#include "ftcs/discipline/telemetry.h"
#include "ftcs/platform/ptp_transport.h"
#include "ftcs/ptp/counters.h"
#include "ftcs/time/instant.h"

namespace ftcs::daemon {

/// Everything of a port that is counted from its start.
struct PortTotals {
  ptp::Counters counters{};
  std::uint64_t receive_stamps_missing = 0;
  std::uint64_t unicast_dropped = 0;
  std::uint64_t foreign_changes = 0;
  DisciplineCounters samples{};
};

/// What a port has met lately, so that what is said of it is of now: who talked, and what was
/// counted, over the last one to two windows.
class PortObserver {
 public:
  PortObserver(const PtpOptions& options, const ptp::ClockIdentity& own, FreeRunningTime start);

  /// Every message that reached the port.
  void on_message(std::span<const std::uint8_t> message) noexcept;
  /// Forgets what it met: a link has come up, and what was not heard before is no sign.
  void restart(FreeRunningTime now, const PortTotals& totals);
  /// Once per turn of the loop.
  void turn(FreeRunningTime now, const PortTotals& totals);
  /// Settings, talkers and what was counted; the rest is the port's to fill in.
  [[nodiscard]] diagnosis::PortSeen seen(FreeRunningTime now, const PortTotals& totals) const;

 private:
  struct Mark {
    FreeRunningTime at{};
    PortTotals totals{};
    diagnosis::Talkers talkers{};  ///< since then
  };

  diagnosis::PortSettings settings_;
  Duration window_;
  Mark older_;
  Mark newer_;
};

/// What is to be heard, as the options say.
[[nodiscard]] diagnosis::PortSettings port_settings(const PtpOptions& options);
/// The settings and the link of a port, and nothing else.
[[nodiscard]] diagnosis::PortSeen seen_of_link(const PtpOptions& options,
                                               const platform::PtpTransport& transport);

}  // namespace ftcs::daemon
