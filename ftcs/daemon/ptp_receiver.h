// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "ftcs/daemon/follower_record.h"
#include "ftcs/daemon/port_observer.h"
#include "ftcs/daemon/ptp_port.h"
#include "ftcs/discipline/time_bound.h"
#include "ftcs/node/receiver_node.h"

namespace ftcs::daemon {

/// The node that the options ask for. `seed`: of the Delay_Req intervals.
[[nodiscard]] node::ReceiverNodeConfig receiver_node_config(
    const PtpOptions& options, const PortFacts& facts, const std::optional<LearntState>& learnt,
    std::uint64_t seed);

/// A clock, virtual or real, that follows a PTP time transmitter: a node::ReceiverNode between
/// sockets and log.
class PtpReceiver : public PtpPort, private Managed {
 public:
  PtpReceiver(platform::Kernel& kernel, const PtpOptions& options, Log& log,
              std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts,
              RealClock* real_clock);

  /// What has come of it lately, for a diagnosis.
  [[nodiscard]] diagnosis::PortSeen seen() { return seen(now()); }
  /// The reference's time, and between which instants it is.
  [[nodiscard]] TimeBound time() const {
    return time_bound(node_.discipline().latest(), node_.discipline().samples());
  }
  /// Whether the reference says that it shows TAI.
  [[nodiscard]] bool follows_tai() const {
    const ptp::TransmitterData* const selected = node_.port().transmitter();
    return selected != nullptr && (selected->flags & ptp::flag::kPtpTimescale) != 0;
  }
  /// Whom it follows; none: nobody.
  [[nodiscard]] std::optional<ptp::PortIdentity> transmitter() const {
    const ptp::TransmitterData* const selected = node_.port().transmitter();
    return selected == nullptr ? std::nullopt : std::optional(selected->port);
  }

 protected:
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] const node::ReceiverNode& node() const { return node_; }
  /// What the port does, or what it waits for.
  [[nodiscard]] std::string service_sentence();

 private:
  void start(FreeRunningTime now) override;
  void on_event(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                FreeRunningTime now) override;
  void on_general(std::span<const std::uint8_t> bytes, FreeRunningTime now) override;
  void on_sent(const ptp::EventId& id, std::optional<FreeRunningTime> sent,
               FreeRunningTime now) override;
  void on_timer(FreeRunningTime now) override;
  void on_link_change(bool up, FreeRunningTime now) override;
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const override {
    return node_.deadline();
  }
  [[nodiscard]] int finish() override;
  [[nodiscard]] Managed* managed() override { return this; }
  [[nodiscard]] ptp::ManagedPort managed_port() override;
  [[nodiscard]] std::string status(const ptp::ManagementCounters& management) override;

  void take_events(FreeRunningTime now);
  void take(const node::ReceiverEvent& event, FreeRunningTime now);
  void tell(const ptp::Action& action);
  void on_selected(const ptp::TransmitterSelected& selected);
  [[nodiscard]] PortTotals totals();
  [[nodiscard]] diagnosis::PortSeen seen(FreeRunningTime now);
  [[nodiscard]] WatchState watched();
  void log_findings(LogLevel level);
  void follow_scale_change();
  StateKeeper state_;
  node::ReceiverNode node_;
  FollowerRecord record_;
  PortObserver observer_;
  bool looked_for_missing_ = false;
  PortFacts facts_;
};

}  // namespace ftcs::daemon
