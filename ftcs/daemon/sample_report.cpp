// SPDX-License-Identifier: MIT
#include "ftcs/daemon/sample_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/core.h>

namespace ftcs::daemon {
namespace {

// ptp4l's "freq": positive when the local clock runs fast, so that it is slowed down; while nothing
// is steered, the estimate.
double ptp4l_frequency_ppb(const Telemetry& telemetry) {
  const bool unlocked = telemetry.servo.state == ServoState::kUnlocked;
  return 0.0 - (unlocked ? telemetry.servo.rate_ratio : telemetry.applied_rate).ppb();
}

int ptp4l_state(ServoState state) {
  switch (state) {
    case ServoState::kUnlocked:
      return 0;
    case ServoState::kJump:
      return 1;
    case ServoState::kLocked:
    case ServoState::kHoldover:
      break;
  }
  return 2;
}

struct Field {
  std::string_view name;
  std::string text;
};

// JSON has no way to say infinite or not a number.
std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.10g}", value) : std::string{};
}

std::string known(bool is_known, double value) { return is_known ? number(value) : std::string{}; }

// The one list of fields: JSON and CSV agree by construction. Empty: not known.
auto fields(const SampleRecord& record) {
  const Telemetry& t = record.telemetry;
  const ServoSnapshot& servo = t.servo;
  return std::array{
      Field{"time_s", fmt::format("{:.6f}", record.time_s)},
      Field{"verdict", verdict_name(t.verdict)},
      Field{"state", state_name(servo.state)},
      Field{"locked", t.locked ? "true" : "false"},
      Field{"offset_ns", known(record.offset_known, record.offset.ns())},
      Field{"path_delay_ns", known(record.offset_known, servo.path_delay.ns())},
      Field{"applied_rate_ppb", number(t.applied_rate.ppb())},
      Field{"tracking_rate_ppb", number(t.tracking_rate.ppb())},
      Field{"rate_ratio_ppb", number(servo.rate_ratio.ppb())},
      Field{"step_ns", number(t.step.ns())},
      Field{"offset_gain", number(servo.offset_gain)},
      Field{"offset_sigma_ns", number(servo.offset_sigma_ns)},
      Field{"rate_sigma_ppb", number(servo.rate_sigma_ppb)},
      Field{"path_delay_sigma_ns", number(servo.path_delay_sigma_ns)},
      Field{"timestamp_noise_ns", number(servo.timestamp_noise_ns)},
  };
}

bool is_word(std::string_view name) { return name == "verdict" || name == "state"; }

}  // namespace

const char* verdict_name(SampleVerdict verdict) noexcept {
  constexpr std::array kNames{"used", "rejected", "duplicate", "implausible"};
  return kNames[static_cast<std::size_t>(verdict)];
}

const char* state_name(ServoState state) noexcept {
  constexpr std::array kNames{"unlocked", "jump", "locked", "holdover"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string ptp4l_line(const SampleRecord& record) {
  const Telemetry& t = record.telemetry;
  std::string line = fmt::format("master offset {:10d} s{} freq {:+7.0f} path delay {:9d}",
                                 record.offset.rounded_ns(), ptp4l_state(t.servo.state),
                                 ptp4l_frequency_ppb(t), t.servo.path_delay.rounded_ns());
  if (t.verdict != SampleVerdict::kUsed) line.append(" ").append(verdict_name(t.verdict));
  return line;
}

std::string phc2sys_line(const SampleRecord& record, const std::string& clock, const char* source) {
  const Telemetry& t = record.telemetry;
  std::string line = fmt::format("{} {} offset {:9d} s{} freq {:+7.0f} delay {:6d}", clock, source,
                                 record.offset.rounded_ns(), ptp4l_state(t.servo.state),
                                 ptp4l_frequency_ppb(t), t.servo.path_delay.rounded_ns());
  if (t.verdict != SampleVerdict::kUsed) line.append(" ").append(verdict_name(t.verdict));
  return line;
}

std::string json_line(const SampleRecord& record) {
  std::string line;
  for (const Field& field : fields(record)) {
    line += line.empty() ? "{" : ",";
    const std::string value = field.text.empty() ? "null" : field.text;
    line += is_word(field.name) ? fmt::format("\"{}\":\"{}\"", field.name, value)
                                : fmt::format("\"{}\":{}", field.name, value);
  }
  return line + "}";
}

std::string csv_header() {
  std::string line;
  for (const Field& field : fields({})) {
    if (!line.empty()) line += ",";
    line += field.name;
  }
  return line;
}

std::string csv_line(const SampleRecord& record) {
  std::string line;
  for (const Field& field : fields(record)) {
    if (!line.empty()) line += ",";
    line += field.text;
  }
  return line;
}

void SampleSummary::add(const SampleRecord& record) noexcept {
  offset_.add(record.offset.ns());
  frequency_.add(ptp4l_frequency_ppb(record.telemetry));
  delay_.add(record.telemetry.servo.path_delay.ns());
}

std::string SampleSummary::text() const {
  // Divisor n, as ptp4l.
  const auto deviation = [](const RunningStatistics& values) {
    const auto n = static_cast<double>(values.count());
    return n > 1.0 ? values.standard_deviation() * std::sqrt((n - 1.0) / n) : 0.0;
  };
  return fmt::format("rms {:4.0f} max {:4.0f} freq {:+6.0f} +/- {:3.0f} delay {:5.0f} +/- {:3.0f}",
                     offset_.rms(), offset_.max_absolute(), frequency_.mean(),
                     deviation(frequency_), delay_.mean(), deviation(delay_));
}

}  // namespace ftcs::daemon
