// SPDX-License-Identifier: MIT
#include "ftcs/daemon/status_report.h"

#include <array>
#include <utility>

#include <fmt/core.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/report/json.h"
#include "ftcs/report/number_format.h"

namespace ftcs::daemon {
namespace {

const char* reason(SampleVerdict verdict) {
  constexpr std::array kReasons{"", "taken for an outlier", "not newer than its predecessor",
                                "time went backward, or an absurd delay or interval"};
  return kReasons[static_cast<std::size_t>(verdict)];
}

Json to_json(const DisciplineCounters& counters) {
  return {{"used", counters.used},
          {"backward", counters.backward},
          {"rejected", counters.rejected},
          {"duplicate", counters.duplicate},
          {"implausible", counters.implausible},
          {"commands", counters.commands},
          {"steps", counters.steps},
          {"clamps", counters.clamps},
          {"refused", counters.refused},
          {"apply_errors", counters.apply_errors},
          {"holdovers", counters.holdovers},
          {"new_references", counters.new_references}};
}

Json to_json(const ptp::ManagementCounters& counters) {
  return {{"answered", counters.answered},
          {"refused", counters.refused},
          {"ignored", counters.ignored},
          {"malformed", counters.malformed}};
}

Json to_json(const diagnosis::Finding& finding) {
  return {{"cause", std::string(diagnosis::name(finding.cause))},
          {"sentence", diagnosis::sentence(finding)},
          {"seen", finding.seen},
          {"expected", finding.expected},
          {"remedy", finding.remedy}};
}

Json to_json(const std::deque<FollowerRecord::Refusal>& refusals) {
  Json list = Json::array();
  for (const auto& refusal : refusals) {
    Json one{{"time_s", number(refusal.time_s)},
             {"message", refusal.direction == Direction::kForward ? "Sync" : "Delay_Req"},
             {"verdict", verdict_name(refusal.verdict)},
             {"reason", reason(refusal.verdict)}};
    one["offset_ns"] = refusal.offset_ns ? number(*refusal.offset_ns) : Json();
    list.push_back(std::move(one));
  }
  return list;
}

std::string servo_name(const ServoConfig& servo) {
  return std::string(servo_kind_name(servo.kind));
}

// Reading: a field that an older or newer program does not send is not known.
double figure(const Json& status, const char* name) {
  const auto found = status.find(name);
  return found != status.end() && found->is_number() ? found->get<double>()
                                                     : ServoSnapshot::kUnknown;
}
std::string word(const Json& status, const char* name) {
  const auto found = status.find(name);
  return found != status.end() && found->is_string() ? found->get<std::string>() : "-";
}
bool is_true(const Json& status, const char* name) {
  const auto found = status.find(name);
  return found != status.end() && found->is_boolean() && found->get<bool>();
}

std::string time_text(const Json& status, const char* name) {
  return seconds_text(figure(status, name) * 1e-9);
}
std::string rate_text(const Json& status, const char* name) {
  return fraction_text(figure(status, name) * 1e-9);
}

/// "name 3, other 1", of what is not zero.
std::string counts(const Json& status, const char* name) {
  std::string text;
  const auto found = status.find(name);
  if (found == status.end() || !found->is_object()) return "-";
  for (const auto& [key, value] : found->items()) {
    if (!value.is_number_unsigned() || value == 0U) continue;
    text +=
        fmt::format("{}{} {}", text.empty() ? "" : ", ", key, value.template get<std::uint64_t>());
  }
  return text.empty() ? "none" : text;
}

std::string locked_text(const Json& status) {
  if (!is_true(status, "locked")) return "no";
  return fmt::format("yes, for {:.1f} s", figure(status, "locked_for_s"));
}

void add_line(std::string& text, const char* name, const std::string& value) {
  text += fmt::format("{:<16}{}\n", name, value);
}

void add_sentence(std::string& text, const Json& status) {
  const auto found = status.find("diagnosis");
  if (found == status.end() || !found->is_object()) return;
  add_line(text, "in a sentence", word(*found, "sentence"));
}

void add_refusals(std::string& text, const Json& status) {
  const auto found = status.find("refusals");
  if (found == status.end() || !found->is_array()) return;
  for (const Json& one : *found) {
    add_line(
        text, "  at",
        fmt::format("{:.3f} s: {} {}, offset {}: {}", figure(one, "time_s"), word(one, "message"),
                    word(one, "verdict"), time_text(one, "offset_ns"), word(one, "reason")));
  }
}

void add_follower_lines(std::string& text, const Json& status) {
  add_line(text, "locked", locked_text(status));
  add_sentence(text, status);
  add_line(text, "state", word(status, "state"));
  add_line(text, "offset",
           fmt::format("{} +/- {}", time_text(status, "offset_ns"),
                       time_text(status, "offset_sigma_ns")));
  add_line(text, "path delay",
           fmt::format("{} +/- {}", time_text(status, "path_delay_ns"),
                       time_text(status, "path_delay_sigma_ns")));
  add_line(text, "rate",
           fmt::format("{} +/- {}, applied {}", rate_text(status, "tracking_rate_ppb"),
                       rate_text(status, "rate_sigma_ppb"), rate_text(status, "applied_rate_ppb")));
  add_line(text, "timestamp noise", time_text(status, "timestamp_noise_ns"));
  add_line(text, "last sample", fmt::format("{:.3f} s ago", figure(status, "last_sample_age_s")));
  add_line(text, "since lock", word(status, "summary_since_lock"));
  add_line(text, "samples", counts(status, "samples"));
  add_refusals(text, status);
}

/// Everything that was counted at least once.
Json messages(const ptp::Counters& counters) {
  Json counted = Json::object();
  for (std::size_t i = 0; i < ptp::kCounters; ++i) {
    const auto counter = static_cast<ptp::Counter>(i);
    if (counters[counter] > 0) counted[std::string(to_string(counter))] = counters[counter];
  }
  return counted;
}

Json common(const StatusOfPort& port, ptp::PortState state, const ptp::Counters& counters) {
  const PtpOptions& options = port.options;
  const bool receiver = options.role == Role::kTimeReceiver;
  return {{"program", "ftcs"},
          {"version", FTCS_VERSION},
          {"role", receiver ? "time-receiver" : "time-transmitter"},
          {"source", options.source == Source::kPtp4l ? "ptp4l" : "network"},
          {"interface", options.interface},
          {"domain", options.protocol.domain},
          {"timestamps", port.facts.hardware_stamps ? "hardware" : "software"},
          {"servo", receiver ? Json(servo_name(options.follower.servo)) : Json()},
          {"uptime_s", number(port.uptime_s)},
          {"port_state", std::string(to_string(state))},
          {"management", to_json(port.management)},
          {"messages", messages(counters)}};
}

void add_follower(Json& status, const FollowerRecord& record, FreeRunningTime now) {
  const FollowerRecord::Status known = record.status(now);
  const Telemetry& t = record.discipline().latest();
  const bool has_offset = known.has_sample && known.last.offset_known;
  const auto if_known = [](bool is_known, double value) {
    return is_known ? number(value) : Json();
  };
  status["state"] = state_name(t.servo.state);
  status["locked"] = record.locked();
  status["locked_for_s"] = known.locked_for_s ? number(*known.locked_for_s) : Json();
  status["last_sample_age_s"] = if_known(known.has_sample, known.last_age_s);
  status["offset_ns"] = if_known(has_offset, known.last.offset.ns());
  status["offset_sigma_ns"] = number(t.servo.offset_sigma_ns);
  // Of the sample: peer to peer, the servo knows none.
  status["path_delay_ns"] = if_known(has_offset, known.last.telemetry.servo.path_delay.ns());
  status["path_delay_sigma_ns"] = number(t.servo.path_delay_sigma_ns);
  status["applied_rate_ppb"] = number(t.applied_rate.ppb());
  status["tracking_rate_ppb"] = number(t.tracking_rate.ppb());
  status["rate_ratio_ppb"] = number(t.servo.rate_ratio.ppb());
  status["rate_sigma_ppb"] = number(t.servo.rate_sigma_ppb);
  status["timestamp_noise_ns"] = number(t.servo.timestamp_noise_ns);
  status["summary_since_lock"] = known.since_lock.empty() ? Json() : Json(known.since_lock);
  status["samples"] = to_json(record.discipline().counters());
  status["refusals"] = to_json(known.refusals);
}

void add_transmitter(Json& status, const ptp::TransmitterData* transmitter) {
  if (transmitter == nullptr) {
    status["transmitter"] = nullptr;
    status["grandmaster"] = nullptr;
    status["steps_removed"] = nullptr;
    return;
  }
  status["transmitter"] = std::string(to_text(transmitter->port).view());
  status["grandmaster"] = std::string(to_text(transmitter->announce.grandmaster).view());
  status["steps_removed"] = transmitter->announce.steps_removed + 1;
}

/// Of `ftcs ethercat run` (ethercat/run_status.h).
std::string ethercat_text(const Json& status) {
  std::string text;
  const auto& drives = status.at("drives");
  add_line(text, "segment",
           fmt::format("{}, {} drives, {}", word(status, "interface"), drives.size(),
                       is_true(status, "all_operational") ? "all in OP" : "not all in OP"));
  add_line(
      text, "cycle",
      fmt::format("{}, servo {}, phase {:+.3f} us, rate {:+.3f} ppm, margin {:.1f} us",
                  word(status, "state"), word(status, "servo"), figure(status, "phase_ns") * 1e-3,
                  figure(status, "rate_ppb") * 1e-3, figure(status, "margin_ns") * 1e-3));
  add_sentence(text, status);
  double furthest_ns = ServoSnapshot::kUnknown;
  for (const Json& drive : drives) {
    furthest_ns = std::fmax(furthest_ns, figure(drive, "system_time_difference_ns"));
  }
  add_line(text, "frames",
           fmt::format("working counter {:.0f} of {:.0f}, {:.0f} lost; |0x092C| {}",
                       figure(status, "working_counter"),
                       figure(status, "working_counter_expected"), figure(status, "lost_frames"),
                       std::isnan(furthest_ns) ? "not judged"
                                               : fmt::format("{:.0f} ns at most", furthest_ns)));
  const Json& plant = status.at("plant_time");
  if (!plant.is_object()) return text;
  add_line(text, "plant time",
           fmt::format("{}, {}, {}; dc to plant {:+.3f} us (sigma {:.3f} us), bent by {:+.3f} ppm",
                       word(plant, "source"), word(plant, "mode"), word(plant, "state"),
                       figure(plant, "dc_to_plant_ns") * 1e-3,
                       figure(plant, "dc_to_plant_sigma_ns") * 1e-3,
                       figure(plant, "bus_rate_ppb") * 1e-3));
  return text;
}

std::string text_of(const Json& status) {
  if (word(status, "role") == "ethercat" && status.contains("drives") &&
      status.contains("plant_time")) {
    return ethercat_text(status);
  }
  std::string text;
  add_line(text, "port",
           fmt::format("{}, {}, {}", word(status, "interface"), word(status, "role"),
                       word(status, "port_state")));
  const bool follows = status.contains("locked");
  if (follows) {
    add_line(text, "servo",
             fmt::format("{}, {} timestamps", word(status, "servo"), word(status, "timestamps")));
    add_line(text, "follows",
             fmt::format("{}, grandmaster {}", word(status, "transmitter"),
                         word(status, "grandmaster")));
    add_follower_lines(text, status);
  } else {
    add_sentence(text, status);
  }
  add_line(text, "messages", counts(status, "messages"));
  add_line(text, "uptime", fmt::format("{:.1f} s", figure(status, "uptime_s")));
  return text;
}

int exit_code_of(const Json& status) {
  if (word(status, "role") == "ethercat" && status.contains("diagnosis")) {
    const bool locked = word(status.at("diagnosis"), "cause") == name(diagnosis::Cause::kLocked);
    return locked ? kSuccess : kNotLocked;
  }
  if (status.contains("locked")) return is_true(status, "locked") ? kSuccess : kNotLocked;
  return word(status, "port_state") == to_string(ptp::PortState::kTimeTransmitter) ? kSuccess
                                                                                   : kNotLocked;
}

}  // namespace

std::string receiver_status(const StatusOfPort& port, const ptp::TimeReceiver& core,
                            const FollowerRecord& record, const diagnosis::PortSeen& seen,
                            FreeRunningTime now) {
  Json status = common(port, core.state(), core.counters());
  add_transmitter(status, core.transmitter());
  add_follower(status, record, now);
  status["diagnosis"] = to_json(diagnosis::diagnose(seen));
  return dump(status);
}

std::string monitor_status(const StatusOfPort& port, const ptp::MonitorSource& source,
                           ptp::PortState state, const FollowerRecord& record,
                           const diagnosis::Finding& finding, FreeRunningTime now) {
  Json status = common(port, state, ptp::Counters{});
  const auto& transmitter = source.transmitter();
  status["transmitter"] = transmitter ? Json(std::string(to_text(*transmitter).view())) : Json();
  add_follower(status, record, now);
  status["diagnosis"] = to_json(finding);
  const ptp::MonitorCounters& counters = source.counters();
  status["messages"] = {{"syncs", counters.syncs},
                        {"delays", counters.delays},
                        {"malformed", counters.malformed},
                        {"unknown_tlvs", counters.unknown_tlvs},
                        {"missed_syncs", counters.missed_syncs},
                        {"repeated", counters.repeated},
                        {"restarts", counters.restarts},
                        {"transmitter_changes", counters.transmitter_changes},
                        {"reference_jumps", counters.reference_jumps}};
  return dump(status);
}

std::string transmitter_status(const StatusOfPort& port, const ptp::TimeTransmitter& core,
                               const std::optional<diagnosis::Finding>& trouble) {
  Json status = common(port, core.state(), core.counters());
  if (trouble) {
    status["diagnosis"] = to_json(*trouble);
    status["diagnosis"]["sentence"] =
        fmt::format("not transmitting: {}; {}", trouble->seen, trouble->remedy);
  }
  return dump(status);
}

std::optional<StatusForPeople> read_status(std::string_view json) {
  const Json status = Json::parse(json.begin(), json.end(), nullptr, false);
  if (!status.is_object()) return std::nullopt;
  return StatusForPeople{text_of(status), exit_code_of(status)};
}

}  // namespace ftcs::daemon
