// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "ftcs/experiment/log_formats.h"
#include "ftcs/record/offset_log.h"

namespace ftcs::experiment {
namespace {

/// A time within this part of the interval around a whole number of intervals is taken as that: the
/// log's times are those of printing, to a millisecond, and 50 ppm of a millisecond are 50 ns.
constexpr double kSnap = 0.25;

class LinuxptpLog final : public LogFormat {
 public:
  [[nodiscard]] std::string name() const override { return chosen_.substr(0, chosen_.find(' ')); }
  [[nodiscard]] bool is_heading(std::string_view) const override { return false; }

  [[nodiscard]] std::string take(std::string_view line) override {
    if (const auto parsed = parse_offset_log_line(line); parsed && !parsed->frequency_ppb)
      return "an offset without a frequency";
    return log_.add(line);
  }

  [[nodiscard]] std::string finish(RecordedLog& log, const std::string& source) override {
    const OffsetLog::Source* picked = log_.pick(source);
    if (picked == nullptr)
      return fmt::format("no offsets of '{}': the log has {}", source, log_.describe_sources());
    log.source = chosen_ = picked->name;
    if (log_.sources().size() > 1) {
      log.notes.push_back(fmt::format("the log has {}: {} is replayed; --source chooses",
                                      log_.describe_sources(), chosen_));
    }
    keep_ascending(*picked, log);
    rebuild(log);
    return "";
  }

 private:
  void keep_ascending(const OffsetLog::Source& source, RecordedLog& log) {
    for (const OffsetLogLine& line : source.lines) {
      const bool backward = line.time_s && !lines_.empty() && lines_.back().time_s &&
                            *line.time_s < *lines_.back().time_s;
      if (!backward) lines_.push_back(line);
    }
    log.used = lines_.size();
    const std::size_t dropped = source.lines.size() - lines_.size();
    log.unusable += dropped;
    if (dropped > 0)
      log.notes.push_back(fmt::format("{} lines whose time goes backward are left out", dropped));
  }

  void rebuild(RecordedLog& log) {
    const bool free_running = std::all_of(lines_.begin(), lines_.end(),
                                          [](const OffsetLogLine& l) { return l.state == 0; });
    const std::vector<double> steps_s = intervals(log);
    log.steered = !free_running;
    log.notes.push_back(
        free_running
            ? "s0 throughout: the clock was free-running already; the frequency column is a "
              "measurement and is not added"
            : "the free-running clock is rebuilt from offset and applied frequency; a step (s1) "
              "takes the offset away");
    log.notes.push_back(
        "offsets are those that the program computed: its path-delay filter is in them");
    Duration reference{};
    double x_ns = lines_.front().offset_ns;
    log.pairs.push_back(offset_pair(reference, Duration::from_ns(x_ns)));
    for (std::size_t i = 1; i < lines_.size(); ++i) {
      reference += Duration::from_ns(steps_s[i - 1] * 1e9);
      x_ns = free_running ? lines_[i].offset_ns : x_ns + change_ns(i, steps_s[i - 1]);
      log.pairs.push_back(
          offset_pair(reference, Duration::from_ns(x_ns), lines_[i].offset_ns - x_ns));
    }
  }

  /// How much the free-running clock gained between lines i - 1 and i. The printed frequency is how
  /// fast the program takes the oscillator to be; it runs the clock slower by as much.
  [[nodiscard]] double change_ns(std::size_t i, double dt_s) const {
    const OffsetLogLine& before = lines_[i - 1];
    const double start_ns = before.state == 1 ? 0.0 : before.offset_ns;
    return lines_[i].offset_ns - start_ns + *before.frequency_ppb * dt_s;
  }

  [[nodiscard]] std::vector<double> intervals(RecordedLog& log) const {
    std::vector<double> steps;
    bool timed = true;
    for (std::size_t i = 1; i < lines_.size(); ++i) {
      timed = timed && lines_[i].time_s && lines_[i - 1].time_s;
      steps.push_back(timed ? *lines_[i].time_s - *lines_[i - 1].time_s : 1.0);
    }
    if (!timed || steps.empty()) {
      log.notes.push_back("lines without a time: one second between them is assumed");
      std::fill(steps.begin(), steps.end(), 1.0);
      return steps;
    }
    std::vector<double> ordered = steps;
    std::sort(ordered.begin(), ordered.end());
    const double median = ordered[ordered.size() / 2];
    // Sync intervals are powers of two seconds; the median of times printed to 1 ms is near one.
    const double nominal = median > 0.0 ? std::exp2(std::round(std::log2(median))) : 1.0;
    const double interval = std::abs(median - nominal) < 0.1 * nominal ? nominal : median;
    for (double& step : steps) {
      const double whole = std::round(step / interval);
      if (whole >= 1.0 && std::abs(step - whole * interval) < kSnap * interval)
        step = whole * interval;
    }
    return steps;
  }

  OffsetLog log_;
  std::string chosen_ = "linuxptp";
  std::vector<OffsetLogLine> lines_;  ///< of the chosen source
};

}  // namespace

std::unique_ptr<LogFormat> detect_linuxptp(std::string_view line) {
  // Start-up messages come before the first offset; a log of summaries alone shall be told as that.
  if (!parse_offset_log_line(line) && !is_summary_line(line)) return nullptr;
  return std::make_unique<LinuxptpLog>();
}

}  // namespace ftcs::experiment
