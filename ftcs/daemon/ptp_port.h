// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ftcs/clock/skewed_source.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/follower_record.h"
#include "ftcs/daemon/log.h"
#include "ftcs/daemon/management_server.h"
#include "ftcs/daemon/port_data_sets.h"
#include "ftcs/daemon/port_observer.h"
#include "ftcs/daemon/ptp_clock.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/real_clock.h"
#include "ftcs/daemon/service_report.h"
#include "ftcs/daemon/time_feed.h"
#include "ftcs/daemon/time_publisher.h"
#include "ftcs/daemon/watch/watch.h"
#include "ftcs/platform/ptp_transport.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/platform/timestamp_clock.h"
#include "ftcs/ptp/actions.h"
#include "ftcs/ptp/counters.h"
#include "ftcs/ptp/peer_delay.h"

namespace ftcs::daemon {

/// What a time receiver and a time transmitter have in common around their protocol cores: sockets,
/// the virtual clock, the loop, the log. All instants are readings of the (possibly skewed)
/// free-running oscillator.
class PtpPort : private platform::TransportHandler {
 public:
  /// `timestamps` may be bound to a real clock (TimestampClock::steer()), which is then steered;
  /// otherwise a virtual one is made.
  PtpPort(platform::Kernel& kernel, const PtpOptions& options, Log& log,
          std::unique_ptr<platform::TimestampClock> timestamps, RealClock* real_clock = nullptr);
  ~PtpPort() override = default;

  /// Until SIGINT, SIGTERM, the configured duration or an error; returns an exit code.
  [[nodiscard]] int run();
  /// The same in a thread of a program that has its own signals: until `stop`, asked four times a
  /// second.
  [[nodiscard]] int run(const std::function<bool()>& stop);
  /// The service manager hears of somebody else whether this program is ready.
  void silence_service() { service_.emplace(platform::ServiceManager("")); }
  /// Why the run ended early; none: it did not.
  [[nodiscard]] const std::optional<std::string>& failure() const { return failure_; }

 protected:
  // What comes in. Event stamps and `now` are on the free-running oscillator.
  virtual void start(FreeRunningTime now) = 0;
  virtual void on_event(std::span<const std::uint8_t> bytes, FreeRunningTime received,
                        FreeRunningTime now) = 0;
  virtual void on_general(std::span<const std::uint8_t> bytes, FreeRunningTime now) = 0;
  virtual void on_sent(const ptp::EventId& id, std::optional<FreeRunningTime> sent,
                       FreeRunningTime now) = 0;
  virtual void on_timer(FreeRunningTime now) = 0;
  virtual void on_link_change(bool up, FreeRunningTime now) = 0;
  [[nodiscard]] virtual std::optional<FreeRunningTime> deadline() const = 0;
  /// Opens where timestamps come from, and waits for them; the network's sockets, unless a port has
  /// none. `underlying`: on the oscillator without skew.
  [[nodiscard]] virtual std::optional<platform::OsError> open_source() {
    return transport_.open_or_wait();
  }
  virtual void wait_until(FreeRunningTime underlying);
  /// Who answers the management socket; null: nobody, and there is none.
  [[nodiscard]] virtual Managed* managed() { return nullptr; }
  /// Once per turn of the loop.
  virtual void housekeeping(FreeRunningTime) {}
  /// Writes the summary, returns the exit code.
  [[nodiscard]] virtual int finish() = 0;

  /// Sends, notes addresses, tells of the port's state; other actions are the role's.
  void perform(const ptp::Action& action);
  /// Everything that a port counted beside good messages, as one line; nothing if there is none.
  void log_unusual(const ptp::Counters& counters);
  /// What the peer delay mechanism has measured, if it has.
  void log_peer_delay(const ptp::PeerDelay& peer_delay);
  /// The reference's timescale, for a real clock and for other programs.
  void set_scale(const ReferenceScale& scale);
  /// Tells chrony and the like, if that is wanted.
  void feed_others(const FollowerRecord& record);
  /// Whether anybody needs to know the timescale.
  [[nodiscard]] bool needs_scale() const {
    return real_clock_ != nullptr || (feed_ && feed_->is_on());
  }
  /// Ends run() with an error line.
  void fail(const std::string& reason);
  [[nodiscard]] bool has_failed() const { return failure_.has_value(); }
  [[nodiscard]] FreeRunningTime now() { return oscillator_.now(); }
  /// The settings and the link of the port, and nothing else.
  [[nodiscard]] diagnosis::PortSeen seen_of_link() const {
    return daemon::seen_of_link(options_, transport_);
  }
  /// To the page of ftcs_now.h, if one was asked for.
  void publish_time(const TimeBound& bound);
  [[nodiscard]] SkewedSource& oscillator() { return oscillator_; }
  [[nodiscard]] AdjustableClock& clock() {
    if (real_clock_ != nullptr) return real_clock_->clock();
    return virtual_clock_;
  }
  /// Who says what may steer a real clock; null: the clock is virtual.
  [[nodiscard]] node::ReferenceGate* gate() { return real_clock_; }
  [[nodiscard]] ServiceReport& service() { return *service_; }
  [[nodiscard]] platform::Kernel& kernel() { return kernel_; }
  /// Null: the clock is virtual.
  [[nodiscard]] RealClock* real_clock() { return real_clock_; }
  /// Null: nobody watches.
  [[nodiscard]] WatchFeed* watch() { return watch_ ? &watch_->feed() : nullptr; }
  /// Tells those who watch, a few times a second. `state()` is asked when it is due.
  template <class State>
  void publish(FreeRunningTime now, const State& state) {
    constexpr Duration kBetween{std::chrono::milliseconds{250}};
    if (!watch_ || now < next_state_) return;
    next_state_ = now + kBetween;
    WatchState known = state();
    known.kind.set("ptp");
    known.target.set(options_.interface);
    known.uptime_s = seconds_since_start();
    watch_->feed().publish(known);
  }
  [[nodiscard]] const PtpOptions& options() const { return options_; }
  [[nodiscard]] Log& log() { return log_; }
  [[nodiscard]] double seconds_since_start() { return (now() - start_.free_running).seconds(); }
  [[nodiscard]] platform::PtpTransport& transport() { return transport_; }
  [[nodiscard]] platform::TimestampClock& timestamps() { return *timestamps_; }
  [[nodiscard]] bool has_hardware_stamps() const { return timestamps_->is_hardware(); }

 private:
  void on_message(const platform::ReceivedMessage& message) override;
  void on_transmitted(const platform::TransmittedMessage& message) override;
  void on_link(bool up, const std::string& reason) override;
  void on_readable(int descriptor) override;
  void send(const ptp::SendMessage& message);
  [[nodiscard]] std::optional<platform::OsError> hand_over(const ptp::SendMessage& message);
  [[nodiscard]] bool open_management();
  void report_keys();
  void read_keys_again();
  [[nodiscard]] bool open_feed();
  bool open_time_page();
  [[nodiscard]] bool open_watch();
  void report_stamps();
  void start_port();
  void turn(std::optional<FreeRunningTime> end);

  platform::Kernel& kernel_;
  PtpOptions options_;
  Log& log_;
  std::unique_ptr<platform::TimestampClock> timestamps_;
  platform::TimestampClock::RealtimeReading start_;
  SkewedSource oscillator_;
  VirtualClock virtual_clock_;
  RealClock* real_clock_;
  platform::PtpTransport transport_;
  std::optional<TimeFeed> feed_{};
  std::optional<TimePublisher> publisher_;
  std::optional<ManagementServer> management_{};
  platform::SocketAddress sender_{};  ///< of the message that is being handled
  platform::SocketAddress transmitter_{};
  std::optional<platform::StampSource> reported_stamps_{};
  bool started_ = false;
  bool stamp_missed_ = false;
  bool send_failed_ = false;
  std::vector<ptp::EventId> unsent_{};  ///< event messages that the network did not take
  std::unique_ptr<Watch> watch_;
  FreeRunningTime next_state_{};
  std::optional<ServiceReport> service_{std::in_place};
  std::optional<std::string> failure_{};
};

/// An identity for the port: configured, made of the interface's address, or (loopback has none) of
/// the process.
[[nodiscard]] Result<ptp::PortIdentity, platform::OsError> port_identity(platform::Kernel& kernel,
                                                                         const PtpOptions& options);

/// Identity, address and kind of stamps of the port that the options ask for.
[[nodiscard]] Result<PortFacts, platform::OsError> port_facts(platform::Kernel& kernel,
                                                              const PtpOptions& options,
                                                              const PtpClocks& clocks);

/// Opens clock and sockets and runs the role that the options ask for. Returns an exit code.
[[nodiscard]] int run_ptp(platform::Kernel& kernel, const PtpOptions& options);

}  // namespace ftcs::daemon
