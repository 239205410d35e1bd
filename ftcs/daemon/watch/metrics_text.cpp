// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/metrics_text.h"

#include <array>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace ftcs::daemon {
namespace {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\' || c == '"') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result;
}

/// Writes families, one after another.
class Exposition {
 public:
  Exposition(const WatchState& state, MetricsFormat format)
      : format_(format),
        clock_(fmt::format("clock=\"{}:{}\"", escaped(state.kind.view()),
                           escaped(state.target.view()))) {}

  struct Sample {
    std::string labels;
    double value;
  };
  void gauge(std::string_view name, std::string_view help, double value) {
    gauges(name, help, {{"", value}});
  }
  void gauges(std::string_view name, std::string_view help, const std::vector<Sample>& samples) {
    family(name, name, "gauge", help, samples);
  }
  void counter(std::string_view name, std::string_view help, std::uint64_t value) {
    counters(name, help, {{"", static_cast<double>(value)}});
  }
  /// `name` without _total.
  void counters(std::string_view name, std::string_view help, const std::vector<Sample>& samples) {
    const std::string total = fmt::format("{}_total", name);
    const bool open = format_ == MetricsFormat::kOpenMetrics;
    family(open ? name : std::string_view{total}, total, "counter", help, samples);
  }
  /// Labels of its own, without the clock's.
  void plain(std::string_view name, std::string_view help, const std::string& labels,
             double value) {
    if (std::isnan(value)) return;
    text_ += fmt::format("# HELP {0} {1}\n# TYPE {0} gauge\n{0}{{{2}}} {3}\n", name, help, labels,
                         value);
  }
  [[nodiscard]] std::string take() {
    if (format_ == MetricsFormat::kOpenMetrics) text_ += "# EOF\n";
    return std::move(text_);
  }

 private:
  void family(std::string_view name, std::string_view sample_name, std::string_view type,
              std::string_view help, const std::vector<Sample>& samples) {
    std::string lines;
    for (const Sample& sample : samples) {
      if (std::isnan(sample.value)) continue;
      lines += fmt::format("{}{{{}{}{}}} {}\n", sample_name, clock_,
                           sample.labels.empty() ? "" : ",", sample.labels, sample.value);
    }
    if (lines.empty()) return;
    text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n{}", name, help, name, type, lines);
  }

  MetricsFormat format_;
  std::string clock_;
  std::string text_;
};

std::string label(std::string_view name, std::string_view value) {
  return fmt::format("{}=\"{}\"", name, escaped(value));
}

void write_clock(Exposition& out, const WatchState& state) {
  out.gauges(
      "ftcs_info", "Program, servo and what is followed",
      {{fmt::format("{},{},{}", label("version", FTCS_VERSION), label("servo", state.servo.view()),
                    label("reference", state.reference.view())),
        1.0}});
  out.gauge("ftcs_uptime_seconds", "Since the start of the program", state.uptime_s);
  out.gauge("ftcs_offset_seconds", "Of the clock from its reference, as perceived",
            measured_offset_ns(state) * 1e-9);
  out.gauge("ftcs_offset_sigma_seconds",
            "Standard deviation of that offset, as the servo states it", state.sigma_ns * 1e-9);
  out.gauge("ftcs_offset_bound_seconds",
            "Offset, three sigma and the largest asymmetry of the path",
            offset_bound_ns(state) * 1e-9);
  out.gauge("ftcs_frequency_ratio", "Rate that is applied to the clock, minus one",
            state.rate_ppb * 1e-9);
  out.gauge("ftcs_path_delay_seconds", "Mean delay from the reference", state.delay_ns * 1e-9);
  std::vector<Exposition::Sample> modes;
  for (std::size_t i = 0; i < kWatchModes; ++i) {
    const auto mode = static_cast<WatchMode>(i);
    modes.push_back({label("state", name(mode)), state.mode == mode ? 1.0 : 0.0});
  }
  out.gauges("ftcs_state", "One for the state that the clock is in", modes);
  out.gauges("ftcs_diagnosis",
             "One, with the cause that keeps the clock from its lock (or: locked)",
             {{label("cause", diagnosis::name(state.cause)), 1.0}});
  out.counter("ftcs_samples_used", "Measurements that the servo used", state.used);
  out.counters("ftcs_samples_refused", "Measurements that it did not use",
               {{label("reason", "outlier"), static_cast<double>(state.outliers)},
                {label("reason", "duplicate"), static_cast<double>(state.duplicates)},
                {label("reason", "implausible"), static_cast<double>(state.implausible)}});
  out.counter("ftcs_steps", "Steps of the clock", state.steps);
  out.counter("ftcs_holdovers", "Times that the reference was silent", state.holdovers);
}

void write_messages(Exposition& out, const WatchedMessages& messages) {
  out.counter("ftcs_messages_authentic", "PTP messages by a key of ours", messages.authentic);
  out.counters("ftcs_messages_dropped", "PTP messages that were not authentic, or copies",
               {{label("reason", "missing"), static_cast<double>(messages.missing)},
                {label("reason", "unknown_key"), static_cast<double>(messages.unknown_key)},
                {label("reason", "wrong_code"), static_cast<double>(messages.wrong_code)},
                {label("reason", "unsupported"), static_cast<double>(messages.unsupported)},
                {label("reason", "replayed"), static_cast<double>(messages.replayed)}});
}

void write_tdev(Exposition& out, const std::vector<StabilityPoint>& tdev) {
  std::vector<Exposition::Sample> samples;
  samples.reserve(tdev.size());
  for (const StabilityPoint& point : tdev) {
    // A grid that does not move with the measured interval.
    samples.push_back({label("tau", fmt::format("{:.2g}", point.tau_s)), point.deviation});
  }
  out.gauges("ftcs_tdev_seconds", "Time deviation of the offset at the averaging time tau",
             samples);
}

void write_cycle(Exposition& out, const WatchedCycle& cycle, double phase_ns) {
  if (!cycle.present) return;
  out.gauge("ftcs_cycle_phase_seconds", "Of the cycle from the distributed clock", phase_ns * 1e-9);
  out.gauge("ftcs_cycle_margin_seconds", "From the arrival of the frame to SYNC0, median",
            cycle.margin_ns * 1e-9);
  out.gauge("ftcs_cycle_wkc", "Of the last cycle", cycle.working_counter);
  out.gauge("ftcs_cycle_wkc_expected", "Of the drives that take part", cycle.expected_counter);
  out.counter("ftcs_frames_lost", "Frames that did not come back in time", cycle.lost);
  out.counter("ftcs_cycles_late", "Cycles that began later than the gate", cycle.late);
  constexpr std::array<std::pair<std::uint8_t, const char*>, 5> kStates{
      {{1, "init"}, {2, "preop"}, {3, "boot"}, {4, "safeop"}, {8, "op"}}};
  std::vector<Exposition::Sample> states;
  std::vector<Exposition::Sample> margins;
  const std::size_t drives = std::min<std::size_t>(cycle.drives, WatchedCycle::kDrives);
  for (const auto& [state, word] : kStates) {
    double count = 0.0;
    for (std::size_t i = 0; i < drives; ++i) count += (cycle.drive[i].state & 15U) == state;
    states.push_back({label("state", word), count});
  }
  for (std::size_t i = 0; i < drives; ++i) {
    margins.push_back(
        {label("drive", std::to_string(i)), static_cast<double>(cycle.drive[i].margin_us) * 1e-6});
  }
  out.gauges("ftcs_drives", "Drives in each state", states);
  out.gauge("ftcs_axes_in_fault", "Axes in the state Fault of CiA 402", cycle.axes_in_fault);
  out.gauges("ftcs_drive_margin_seconds", "From the arrival of the frame at the drive to its SYNC0",
             margins);
}

/// The names that dashboards of OpenShift's PTP operator read.
std::string openshift(const MetricsInput& input, MetricsFormat format) {
  const WatchState& state = input.state;
  Exposition out(state, format);
  const std::string labels =
      fmt::format("{},{},{},{}", label("from", state.kind.view() == "phc" ? "phc" : "master"),
                  label("process", "ftcs"), label("node", ""), label("iface", state.target.view()));
  const double clock = state.mode == WatchMode::kLocked     ? 1.0
                       : state.mode == WatchMode::kHoldover ? 2.0
                                                            : 0.0;
  out.plain("openshift_ptp_offset_ns", "Offset, ns", labels, measured_offset_ns(state));
  out.plain("openshift_ptp_max_offset_ns", "Largest offset of the last minutes, ns", labels,
            input.largest_offset_ns);
  out.plain("openshift_ptp_delay_ns", "Path delay, ns", labels, state.delay_ns);
  out.plain("openshift_ptp_frequency_adjustment_ns", "Rate that is applied, ns/s", labels,
            state.rate_ppb);
  out.plain("openshift_ptp_clock_state", "0 FREERUN, 1 LOCKED, 2 HOLDOVER", labels, clock);
  out.plain("openshift_ptp_process_status", "1 UP", labels, 1.0);
  return out.take();
}

}  // namespace

std::string metrics_text(const MetricsInput& input, MetricsNames names, MetricsFormat format) {
  if (names == MetricsNames::kOpenShift) return openshift(input, format);
  Exposition out(input.state, format);
  write_clock(out, input.state);
  write_tdev(out, input.tdev);
  if (input.state.messages.present) write_messages(out, input.state.messages);
  write_cycle(
      out, input.state.cycle,
      input.state.mode == WatchMode::kHoldover ? WatchState::kUnknown : input.state.cycle.phase_ns);
  return out.take();
}

std::string metrics_type(MetricsFormat format) {
  return format == MetricsFormat::kOpenMetrics
             ? "application/openmetrics-text; version=1.0.0; charset=utf-8"
             : "text/plain; version=0.0.4; charset=utf-8";
}

}  // namespace ftcs::daemon
