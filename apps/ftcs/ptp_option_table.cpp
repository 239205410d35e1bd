// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_option_table.h"

#include <array>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <type_traits>
#include <utility>

#include <fmt/core.h>

#include "apps/ftcs/ptp_fixed_settings.h"
#include "apps/ftcs/steering_arguments.h"
#include "ftcs/record/quantity_text.h"
#include "ftcs/report/suggestion.h"

namespace ftcs::app {
namespace {

using Wrong = std::optional<std::string>;

template <class Target>
Wrong integer(std::string_view text, Target& target, std::int64_t lowest, std::int64_t highest) {
  const auto value = parse_integer(text, lowest, highest);
  if (!value) return value.error().message;
  target = static_cast<Target>(*value);
  return std::nullopt;
}

Wrong nanoseconds(std::string_view text, Nanoseconds& target) {
  constexpr std::int64_t kLargest = 1'000'000'000;  // a second of cable is no asymmetry
  std::int64_t value = 0;
  if (auto wrong = integer(text, value, -kLargest, kLargest)) return wrong;
  target = Nanoseconds{value};
  return std::nullopt;
}

Wrong seconds(std::string_view text, Nanoseconds& target) {
  const auto value = parse_number(text, 0.0, 1e9);
  if (!value) return value.error().message;
  target = Nanoseconds{Duration::from_ns(*value * 1e9).rounded_ns()};
  return std::nullopt;
}

Wrong number(std::string_view text, double& target, double lowest = 0.0) {
  const auto value = parse_number(text, lowest, std::numeric_limits<double>::max());
  if (!value) {
    return fmt::format("'{}': expected a plain number, {}", text,
                       lowest == 0.0 ? "0 or more" : "without a unit");
  }
  target = *value;
  return std::nullopt;
}

Wrong boolean(std::string_view text, bool& target) {
  if (text != "0" && text != "1") return fmt::format("'{}': expected 0 or 1", text);
  target = text == "1";
  return std::nullopt;
}

Wrong only(std::string_view text, std::string_view supported) {
  if (text == supported) return std::nullopt;
  return fmt::format("'{}' is not supported, only {}", text, supported);
}

Wrong interval(std::string_view text, std::int8_t& target) { return integer(text, target, -7, 7); }

Wrong set_identity(daemon::PtpOptions& options, std::string_view text) {
  const auto identity = parse_clock_identity(text);
  if (!identity) return fmt::format("'{}': expected 001122.fffe.334455", text);
  if (*identity != ptp::ClockIdentity{})
    options.protocol.clock_identity = identity;  // zero: the default
  return std::nullopt;
}

/// One of a few words.
template <class Value>
Wrong choose(std::string_view text, Value& target,
             std::initializer_list<std::pair<std::string_view, std::type_identity_t<Value>>> all) {
  std::string words;
  for (const auto& choice : all) {
    if (text == choice.first) return target = choice.second, std::nullopt;
    words.append(words.empty() ? "" : &choice + 1 == all.end() ? " and " : ", ");
    words.append(choice.first);
  }
  return fmt::format("'{}' is not supported, only {}", text, words);
}

Wrong set_delay_mechanism(daemon::PtpOptions& options, std::string_view text) {
  using ptp::DelayMechanism;
  return choose(text, options.protocol.delay_mechanism,
                {{"E2E", DelayMechanism::kEndToEnd}, {"P2P", DelayMechanism::kPeerToPeer}});
}

Wrong set_transport(daemon::PtpOptions& options, std::string_view text) {
  const auto transport = platform::transport_from_name(text);
  if (!transport) return fmt::format("'{}' is not supported, only UDPv4, UDPv6 and L2", text);
  options.socket.transport = *transport;
  return std::nullopt;
}

Wrong mac(std::string_view text, platform::MacAddress& target) {
  const auto address = platform::parse_mac(std::string(text));
  if (!address) return fmt::format("'{}': expected 01:1B:19:00:00:00", text);
  target = *address;
  return std::nullopt;
}

Wrong set_capable(daemon::PtpOptions& options, std::string_view text) {
  return choose(text, options.protocol.always_capable, {{"auto", false}, {"true", true}});
}

Wrong set_clock_servo(daemon::PtpOptions& options, std::string_view text) {
  if (auto wrong = only(text, "pi")) return *wrong + " (--servo knows more)";
  options.follower.servo.kind = ServoKind::kLinuxptpPi;
  return std::nullopt;
}

Wrong set_driftfile(daemon::PtpOptions& options, std::string_view text) {
  const std::filesystem::path path(text);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code ignored;
  if (!path.has_filename() || !std::filesystem::is_directory(folder, ignored)) {
    return fmt::format("'{}': expected a file in a folder that exists", text);
  }
  options.follower.driftfile = text;
  return std::nullopt;
}

Wrong set_delay_filter(daemon::PtpOptions& options, std::string_view text) {
  options.follower.filter_is_chosen = true;
  return choose(text, options.follower.servo.two_way.path_delay.filter.kind,
                {{"moving_median", DelayFilterKind::kMovingMedian},
                 {"moving_minimum", DelayFilterKind::kMovingMinimum},
                 {"steady_mean", DelayFilterKind::kSteadyMean}});
}

Wrong set_time_stamping(daemon::PtpOptions& options, std::string_view text) {
  using platform::TimestampMode;
  return choose(text, options.timestamps,
                {{"hardware", TimestampMode::kHardware}, {"software", TimestampMode::kSoftware}});
}

Wrong set_receiver_only(daemon::PtpOptions& options, std::string_view text) {
  bool receiver_only = true;
  if (auto wrong = boolean(text, receiver_only)) return wrong;
  if (receiver_only) {
    options.role = daemon::Role::kTimeReceiver;
  } else if (options.role == daemon::Role::kTimeReceiver) {
    options.notes.emplace_back(
        "slaveOnly 0: this port keeps the role it was given (--role) and never becomes a time "
        "transmitter by itself");
  }
  return std::nullopt;
}

Wrong set_transmitter_only(daemon::PtpOptions& options, std::string_view text) {
  bool transmitter_only = false;
  if (auto wrong = boolean(text, transmitter_only)) return wrong;
  if (transmitter_only) options.role = daemon::Role::kTimeTransmitter;
  return std::nullopt;
}

Wrong set_timeout(daemon::PtpOptions& options, std::string_view text) {
  std::int64_t milliseconds = 0;
  if (auto wrong = integer(text, milliseconds, 1, 10'000)) return wrong;
  options.socket.tx_timestamp_timeout = std::chrono::milliseconds{milliseconds};
  return std::nullopt;
}

Wrong set_spp(daemon::PtpOptions& options, std::string_view text) {
  int spp = 0;
  if (auto wrong = integer(text, spp, -1, 255)) return wrong;
  options.protocol.authentication.spp.reset();
  if (spp >= 0) options.protocol.authentication.spp = static_cast<std::uint8_t>(spp);
  return std::nullopt;
}

Wrong set_uds_address(daemon::PtpOptions& options, std::string_view text) {
  options.management.socket = text == "none" ? "" : text;
  options.management.is_required = true;
  return std::nullopt;
}

/// A number that `set` judges.
template <class Target>
Wrong number_for(Wrong (*set)(double, Target&), std::string_view text, Target& target) {
  double value = 0.0;
  if (auto wrong = number(text, value, std::numeric_limits<double>::lowest())) return wrong;
  return set(value, target);
}

#define FTCS_SET(expression) \
  [](daemon::PtpOptions& o, std::string_view v) -> Wrong { return expression; }

constexpr std::array kSettings{
    PtpSetting{"domainNumber", "PTP domain, 0 to 255",
               FTCS_SET(integer(v, o.protocol.domain, 0, 255))},
    PtpSetting{"transportSpecific", "majorSdoId, 0 to 15",
               FTCS_SET(integer(v, o.protocol.major_sdo_id, 0, 15))},
    PtpSetting{"ptp_minor_version", "0 (IEEE 1588-2008) or 1",
               FTCS_SET(integer(v, o.protocol.minor_version, 0, 1))},
    PtpSetting{"logAnnounceInterval", "log2 of seconds, -7 to 7",
               FTCS_SET(interval(v, o.protocol.log_announce_interval))},
    PtpSetting{"logSyncInterval", "log2 of seconds, -7 to 7",
               FTCS_SET(interval(v, o.transmitter.log_sync_interval))},
    PtpSetting{"logMinDelayReqInterval", "log2 of seconds, -7 to 7",
               FTCS_SET(interval(v, o.protocol.log_min_delay_req_interval))},
    PtpSetting{"announceReceiptTimeout", "announce intervals, 2 to 10",
               FTCS_SET(integer(v, o.receiver.announce_receipt_timeout, 2, 10))},
    PtpSetting{"priority1", "0 to 255", FTCS_SET(integer(v, o.transmitter.priority1, 0, 255))},
    PtpSetting{"priority2", "0 to 255", FTCS_SET(integer(v, o.transmitter.priority2, 0, 255))},
    PtpSetting{"clockClass", "0 to 255",
               FTCS_SET(integer(v, o.transmitter.quality.clock_class, 0, 255))},
    PtpSetting{"clockAccuracy", "0x00 to 0xFE",
               FTCS_SET(integer(v, o.transmitter.quality.clock_accuracy, 0, 0xFE))},
    PtpSetting{"offsetScaledLogVariance", "0x0000 to 0xFFFF",
               FTCS_SET(integer(v, o.transmitter.quality.offset_scaled_log_variance, 0, 0xFFFF))},
    PtpSetting{"utc_offset", "TAI - UTC in seconds",
               FTCS_SET(integer(v, o.transmitter.utc_offset, -32768, 32767))},
    PtpSetting{"timeSource", "0x00 to 0xFF",
               FTCS_SET(integer(v, o.transmitter.time_source, 0, 0xFF))},
    PtpSetting{"clockIdentity", "001122.fffe.334455", set_identity},
    PtpSetting{"slaveOnly", "1: time receiver", set_receiver_only},
    PtpSetting{"clientOnly", "1: time receiver", set_receiver_only},
    PtpSetting{"masterOnly", "1: time transmitter", set_transmitter_only},
    PtpSetting{"serverOnly", "1: time transmitter", set_transmitter_only},
    PtpSetting{"delayAsymmetry", "ns, positive if the way to the receiver is longer",
               FTCS_SET(nanoseconds(v, o.receiver.delay_asymmetry))},
    PtpSetting{"egressLatency", "ns, added to transmit timestamps",
               FTCS_SET(nanoseconds(v, o.protocol.egress_latency))},
    PtpSetting{"ingressLatency", "ns, subtracted from receive timestamps",
               FTCS_SET(nanoseconds(v, o.protocol.ingress_latency))},
    PtpSetting{"tx_timestamp_timeout", "ms", set_timeout},
    PtpSetting{"udp_ttl", "1 to 255", FTCS_SET(integer(v, o.socket.ttl, 1, 255))},
    PtpSetting{"time_stamping", "hardware or software; default: the best available",
               set_time_stamping},
    PtpSetting{"network_transport", "UDPv4 (-4), UDPv6 (-6) or L2 (-2)", set_transport},
    PtpSetting{"delay_mechanism", "E2E (-E) or P2P (-P)", set_delay_mechanism},
    PtpSetting{"hybrid_e2e", "1: delay requests go to the transmitter's own address",
               FTCS_SET(boolean(v, o.receiver.hybrid))},
    PtpSetting{"logMinPdelayReqInterval", "log2 of seconds, -7 to 7",
               FTCS_SET(interval(v, o.protocol.peer_delay.log_min_interval))},
    PtpSetting{"neighborPropDelayThresh", "ns; above it the neighbour is not 802.1AS capable",
               FTCS_SET(nanoseconds(v, o.protocol.peer_delay.highest))},
    PtpSetting{"min_neighbor_prop_delay", "ns; below it the neighbour is not 802.1AS capable",
               FTCS_SET(nanoseconds(v, o.protocol.peer_delay.lowest))},
    PtpSetting{"asCapable", "auto or true", set_capable},
    PtpSetting{"syncReceiptTimeout", "Sync intervals, 0 to 10; 0: never",
               FTCS_SET(integer(v, o.receiver.sync_receipt_timeout, 0, 10))},
    PtpSetting{"assume_two_step", "1: take every Sync for a two-step one",
               FTCS_SET(boolean(v, o.protocol.assume_two_step))},
    PtpSetting{"follow_up_info", "1: 802.1AS in Follow_Up",
               FTCS_SET(boolean(v, o.transmitter.follow_up_info))},
    PtpSetting{"path_trace_enabled", "1: transmit the path trace in Announce",
               FTCS_SET(boolean(v, o.transmitter.path_trace))},
    PtpSetting{"ptp_dst_mac", "L2: where all but peer delay messages go",
               FTCS_SET(mac(v, o.socket.primary_mac))},
    PtpSetting{"p2p_dst_mac", "L2: where peer delay messages go",
               FTCS_SET(mac(v, o.socket.peer_mac))},
    PtpSetting{"udp6_scope", "UDPv6: scope of ff0X::181, 0x00 to 0x0F",
               FTCS_SET(integer(v, o.socket.ipv6_scope, 0, 0xF))},
    PtpSetting{"clock_servo", "pi (as --servo linuxptp-pi)", set_clock_servo},
    PtpSetting{"kernel_leap", "1: the kernel makes leap seconds (system clock)",
               FTCS_SET(boolean(v, o.clock.kernel_leap))},
    PtpSetting{"leapfile", "leap-seconds.list, where Announce has no UTC offset",
               FTCS_SET((o.clock.leap_file = v, Wrong{}))},
    PtpSetting{"free_running", "1: measure, do not steer",
               FTCS_SET(boolean(v, o.follower.free_running))},
    PtpSetting{"first_step_threshold", "s; 0: never",
               FTCS_SET(seconds(v, o.follower.first_step_threshold))},
    PtpSetting{"step_threshold", "s; 0: never", FTCS_SET(seconds(v, o.follower.step_threshold))},
    PtpSetting{"max_path_delay", "ns; 0: any", FTCS_SET(nanoseconds(v, o.follower.max_path_delay))},
    PtpSetting{"max_frequency", "ppb",
               FTCS_SET(number_for(set_max_frequency, v, o.follower.servo))},
    PtpSetting{"max_frequency_change", "ppb: as --max-frequency-change",
               FTCS_SET(number_for(set_max_frequency_change, v, o.follower.steering))},
    PtpSetting{"frequency_granularity", "ppb: as --frequency-granularity",
               FTCS_SET(number_for(set_frequency_granularity, v, o.follower.servo))},
    PtpSetting{"timer_granularity", "ns: as --timer-granularity",
               FTCS_SET(number_for(set_timer_granularity, v, o.follower.servo))},
    PtpSetting{"steering_latency", "ns: as --steering-latency",
               FTCS_SET(number_for(set_steering_latency, v, o.follower.servo))},
    PtpSetting{"never_step", "1: as --never-step",
               FTCS_SET(boolean(v, o.follower.steering.never_step))},
    PtpSetting{"driftfile", "file that keeps the learnt rate and noise over restarts",
               set_driftfile},
    PtpSetting{"driftfile_interval", "s between two writes; default 3600",
               FTCS_SET(seconds(v, o.follower.driftfile_interval))},
    PtpSetting{"delay_filter", "moving_median, moving_minimum or steady_mean", set_delay_filter},
    PtpSetting{"delay_filter_length", "samples, 1 to 32",
               FTCS_SET((o.follower.filter_is_chosen = true,
                         integer(v, o.follower.servo.two_way.path_delay.filter.length, 1,
                                 DelayFilter::kCapacity)))},
    PtpSetting{"pi_proportional_const", "ppb per ns; 0: by scale",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.proportional_const))},
    PtpSetting{"pi_proportional_scale", "0: by time stamping",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.proportional_scale))},
    PtpSetting{"pi_proportional_exponent", "of the sync interval",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.proportional_exponent, -1e3))},
    PtpSetting{"pi_proportional_norm_max", "greatest gain per sample",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.proportional_norm_max))},
    PtpSetting{"pi_integral_const", "ppb per ns; 0: by scale",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.integral_const))},
    PtpSetting{"pi_integral_scale", "0: by time stamping",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.integral_scale))},
    PtpSetting{"pi_integral_exponent", "of the sync interval",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.integral_exponent, -1e3))},
    PtpSetting{"pi_integral_norm_max", "greatest gain per sample",
               FTCS_SET(number(v, o.follower.servo.linuxptp_pi.integral_norm_max))},
    PtpSetting{"uds_address", "the management socket, or none; default /var/run/ftcs",
               set_uds_address},
    PtpSetting{"slave_event_monitor",
               "with --source ptp4l: ptp4l's setting of that name; default /var/run/ftcs-monitor",
               FTCS_SET((o.monitor.stamps = v, Wrong{}))},
    PtpSetting{"sa_file", "file of keys: messages are authenticated (IEEE 1588-2019, 16.14)",
               FTCS_SET((o.protocol.authentication.sa_file = v, Wrong{}))},
    PtpSetting{"spp", "which association of sa_file, 0 to 255; -1: none", set_spp},
    PtpSetting{"active_key_id", "key of what is sent, 1 to 4294967295",
               FTCS_SET(integer(v, o.protocol.authentication.active_key_id, 0, 4'294'967'295))},
    PtpSetting{"logging_level", "0 to 7", FTCS_SET(integer(v, o.log_level, 0, 7))},
    PtpSetting{"summary_interval", "log2 of seconds, -7 to 20",
               FTCS_SET(integer(v, o.summary_interval, -7, 20))},
};

#undef FTCS_SET

}  // namespace

std::optional<ptp::ClockIdentity> parse_clock_identity(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (c != '.' && c != ':') digits.push_back(c);
  }
  ptp::ClockIdentity identity;
  if (digits.size() != 2 * identity.octets.size()) return std::nullopt;
  for (std::size_t i = 0; i < identity.octets.size(); ++i) {
    const auto octet = parse_integer("0x" + digits.substr(2 * i, 2), 0, 255);
    if (!octet.ok()) return std::nullopt;
    identity.octets[i] = static_cast<std::uint8_t>(*octet);
  }
  return identity;
}

std::span<const PtpSetting> ptp_settings() { return kSettings; }

std::optional<std::string> apply_setting(daemon::PtpOptions& options, std::string_view name,
                                         std::string_view value) {
  for (const PtpSetting& setting : kSettings) {
    if (name != setting.name) continue;
    if (auto wrong = setting.set(options, value)) return fmt::format("{}: {}", name, *wrong);
    return std::nullopt;
  }
  if (is_fixed_setting(name)) return check_fixed_setting(name, value);
  std::vector<std::string> names;
  names.reserve(std::size(kSettings));
  for (const PtpSetting& setting : kSettings) names.emplace_back(setting.name);
  return fmt::format("unknown setting '{}'{}", name, did_you_mean(suggestion(name, names)));
}

}  // namespace ftcs::app
