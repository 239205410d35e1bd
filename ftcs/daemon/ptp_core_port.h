// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

#include "ftcs/daemon/ptp_port.h"
#include "ftcs/time/relabel.h"

namespace ftcs::daemon {

/// A PtpPort around a bare protocol core (ptp::TimeTransmitter; the demonstration's
/// ptp::TimeReceiver): hands every input to it. A core's Stamp says on which clock it takes event
/// stamps: its free-running clock, or the reference, which at a transmitter is the port's own
/// clock.
template <class Core>
class PtpCorePort : public PtpPort {
 protected:
  PtpCorePort(platform::Kernel& kernel, const PtpOptions& options, Log& log,
              std::unique_ptr<platform::TimestampClock> timestamps,
              const typename Core::Config& config)
      : PtpPort(kernel, options, log, std::move(timestamps)), core_(config) {}

  [[nodiscard]] Core& core() { return core_; }
  [[nodiscard]] const Core& core() const { return core_; }
  /// Actions that only the role knows.
  virtual void act(const ptp::Action&) {}

 private:
  using Stamp = typename Core::Stamp;

  void start(FreeRunningTime now) final { perform_all(core_.start(now)); }
  void on_event(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                FreeRunningTime now) final {
    perform_all(core_.on_event_message(bytes, stamp_of(received), now));
  }
  void on_general(std::span<const std::uint8_t> bytes, FreeRunningTime now) final {
    perform_all(core_.on_general_message(bytes, now));
  }
  void on_sent(const ptp::EventId& id, std::optional<FreeRunningTime> sent,
               FreeRunningTime now) final {
    perform_all(sent ? core_.on_transmit_timestamp(id, stamp_of(*sent), now)
                     : core_.on_transmit_timestamp_missing(id, now));
  }
  void on_timer(FreeRunningTime now) final { perform_all(core_.on_timer(now)); }
  void on_link_change(bool up, FreeRunningTime now) final {
    perform_all(up ? core_.on_link_up(now) : core_.on_link_down(now));
  }
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const final { return core_.deadline(); }

  void perform_all(const ptp::ActionList& actions) {
    for (const ptp::Action& action : actions) {
      perform(action);
      act(action);
    }
  }
  [[nodiscard]] Stamp stamp_of(FreeRunningTime instant) {
    if constexpr (std::is_same_v<Stamp, ReferenceTime>) {
      return relabel<ReferenceTime>(clock().local_at(instant));
    } else {
      return instant;
    }
  }

  Core core_;
};

}  // namespace ftcs::daemon
