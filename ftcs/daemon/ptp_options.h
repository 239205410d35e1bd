// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/daemon/security.h"
#include "ftcs/daemon/watch/watch.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/discipline/steering_rules.h"
#include "ftcs/node/epoch_gate.h"
#include "ftcs/platform/ptp_socket.h"
#include "ftcs/platform/timestamp_clock.h"
#include "ftcs/ptp/acceptable_transmitters.h"
#include "ftcs/ptp/peer_delay.h"
#include "ftcs/ptp/wire/identity.h"
#include "ftcs/ptp/wire/message.h"
#include "ftcs/servo/any_servo.h"

namespace ftcs::daemon {

enum class Role : std::uint8_t { kTimeReceiver, kTimeTransmitter };
/// What is steered. Timestamps are taken from the same clock: software stamps from CLOCK_REALTIME,
/// hardware stamps from the adapter's.
enum class ClockKind : std::uint8_t {
  kVirtual,  ///< arithmetic alone; the machine's clocks are read
  kSystem,   ///< CLOCK_REALTIME
  kPhc,      ///< the adapter's PTP hardware clock
  kAuto,     ///< the adapter's, if it has one, else CLOCK_REALTIME
};
/// Where a time receiver's timestamps come from.
enum class Source : std::uint8_t {
  kNetwork,  ///< our own sockets
  kPtp4l,    ///< the slave_event_monitor of a ptp4l on this machine
};
enum class Output : std::uint8_t { kText, kJson, kCsv };

/// As the servos' own, but for one: Sync messages of a busy machine come early or late by a tenth
/// of the interval and more, which leaves that part of the offset; four corrections with p = 1
/// leave nothing of it.
[[nodiscard]] inline ServoConfig ptp_servo_defaults() noexcept {
  ServoConfig servo;
  servo.ftcs.converged_dwell = 4;
  return servo;
}

/// The protocol, as a port of either role speaks it. Defaults are ptp4l's where ptp4l has the
/// option; so are those of all other parts.
struct PtpProtocolConfig {
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
  std::uint8_t minor_version = 1;
  std::int8_t log_announce_interval = 1;
  std::int8_t log_min_delay_req_interval = 0;
  ptp::DelayMechanism delay_mechanism = ptp::DelayMechanism::kEndToEnd;
  ptp::PeerDelayConfig peer_delay{};
  bool always_capable = false;  ///< ptp4l's asCapable true: ask nothing of the neighbour
  bool assume_two_step = false;
  std::optional<ptp::ClockIdentity> clock_identity{};
  SecurityOptions authentication{};
  std::shared_ptr<Security> security{};  ///< opened by `authentication`; null: none
  Nanoseconds egress_latency{0};
  Nanoseconds ingress_latency{0};

  [[nodiscard]] bool peer_to_peer() const {
    return delay_mechanism == ptp::DelayMechanism::kPeerToPeer;
  }
  /// As ptp4l: a port that speaks IEEE 802.1AS (majorSdoId 1) asks whether its neighbour does.
  [[nodiscard]] ptp::PeerDelayConfig peer_delay_config() const {
    ptp::PeerDelayConfig config = peer_delay;
    config.capability_needed = peer_to_peer() && major_sdo_id == 1 && !always_capable;
    return config;
  }
};

/// Whom a time receiver follows, and for how long.
struct PtpReceiverConfig {
  std::uint8_t announce_receipt_timeout = 3;
  std::uint8_t sync_receipt_timeout = 0;
  bool hybrid = false;  ///< ptp4l's hybrid_e2e
  ptp::AcceptableTransmitters acceptable{};
  bool fast_start = true;
  Nanoseconds delay_asymmetry{0};
};

/// What a time transmitter says of itself.
struct PtpTransmitterConfig {
  std::int8_t log_sync_interval = 0;
  bool follow_up_info = false;
  bool path_trace = false;
  std::uint8_t priority1 = 128;
  std::uint8_t priority2 = 128;
  ptp::ClockQuality quality{};
  std::int16_t utc_offset = 37;
  std::uint8_t time_source = 0xA0;
};

/// How a clock is made to follow: servo, rules of steering, and what is kept of it.
struct PtpFollowerConfig {
  ServoConfig servo = ptp_servo_defaults();
  Nanoseconds max_path_delay{0};  ///< 0: any
  /// Whoever chose the delay filter means it: the adaptive servo has one of its own.
  bool filter_is_chosen = false;
  SteeringRules steering{};
  node::EpochRules epoch{};
  bool free_running = false;  ///< ptp4l's free_running: measure, steer nothing
  bool first_step = false;    ///< step once, whatever the servo
  Nanoseconds first_step_threshold{20'000};
  Nanoseconds step_threshold{0};
  std::string driftfile{};  ///< where what the servo learns is kept; empty: nowhere
  Nanoseconds driftfile_interval{3'600'000'000'000};
};

/// The clock that is steered.
struct SteeredClockConfig {
  ClockKind kind = ClockKind::kVirtual;
  std::string device{};     ///< kPhc: must be the interface's clock; empty: it is
  std::string leap_file{};  ///< leap-seconds.list
  bool kernel_leap = true;  ///< ptp4l's kernel_leap: leap seconds are the kernel's to make
  /// What CLOCK_REALTIME shows at some instant of the oscillator: read at the start unless it is
  /// given here, so that two processes can stand on one and the same line.
  std::optional<platform::TimestampClock::RealtimeReading> start{};
  Duration initial_offset{};  ///< of the virtual clock against CLOCK_REALTIME
  double skew_ppb = 0.0;      ///< of the virtual clock's oscillator
};

/// The sockets of a ptp4l whose stamps are used instead of our own.
struct MonitorConfig {
  std::string stamps = "/var/run/ftcs-monitor";  ///< its slave_event_monitor
  std::string management = "/var/run/ptp4l";     ///< its uds_address, to ask it
};

/// Our own management socket.
struct ManagementConfig {
  std::string socket;        ///< empty: none
  bool is_required = false;  ///< else a port goes on without it
};

/// Who is told the time, besides the clock.
struct FeedConfig {
  std::string time_page{};            ///< file for ftcs_now.h; empty: none
  std::string chrony_socket{};        ///< refclock SOCK of a chronyd; empty: none
  std::optional<int> ntp_shm_unit{};  ///< NTP's shared memory; none: none
};

/// Everything that `ftcs ptp` can be told, from the command line or a configuration file: the
/// configurations of its parts, and what the program around them does.
struct PtpOptions {
  std::string interface;
  Role role = Role::kTimeReceiver;
  Source source = Source::kNetwork;
  platform::PtpSocketConfig socket{};
  platform::TimestampMode timestamps = platform::TimestampMode::kBestAvailable;

  PtpProtocolConfig protocol{};
  PtpReceiverConfig receiver{};
  PtpTransmitterConfig transmitter{};
  PtpFollowerConfig follower{};
  SteeredClockConfig clock{};
  MonitorConfig monitor{};
  ManagementConfig management{};
  FeedConfig feeds{};
  WatchOptions watch{};  ///< metrics and the live page

  int log_level = 6;         ///< syslog's: 0 emergency to 7 debug
  int summary_interval = 0;  ///< log2 of seconds
  Output output = Output::kText;
  std::optional<Duration> duration{};
  /// Called when all is open that only root may open; returns what failed.
  std::function<std::optional<std::string>()> once_open{};
  /// Settings that mean less here than in ptp4l: logged at the start.
  std::vector<std::string> notes;
};

}  // namespace ftcs::daemon
