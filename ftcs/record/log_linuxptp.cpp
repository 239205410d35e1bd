// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "ftcs/record/log_formats.h"
#include "ftcs/record/offset_log.h"

namespace ftcs {
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
    // ftcs shows what its servo refused, whatever the summary interval is.
    if (line.ends_with(" rejected")) return "an outlier that the servo refused";
    return log_.add(line);
  }

  [[nodiscard]] std::string finish(RecordedLog& log, const std::string& source) override {
    const OffsetLog::Source* picked = log_.pick(source);
    if (picked == nullptr)
      return fmt::format("no offsets of '{}': the log has {}", source, log_.describe_sources());
    log.source = chosen_ = picked->name;
    if (log_.sources().size() > 1) {
      log.notes.push_back(fmt::format("the log has {}: {} is taken; --source chooses",
                                      log_.describe_sources(), chosen_));
    }
    if (picked->lines.size() < picked->summaries.size()) {
      rebuild(steered(ascending(picked->summaries, log), log), log);
      log.unusable += picked->lines.size();
      return "";
    }
    lines_ = ascending(picked->lines, log);
    log.unusable += picked->summaries.size();
    rebuild(log);
    return "";
  }

 private:
  /// Lines whose time does not go backward: a program that was started anew began another clock.
  template <class Line>
  static std::vector<Line> ascending(const std::vector<Line>& lines, RecordedLog& log) {
    std::vector<Line> kept;
    for (const Line& line : lines) {
      const bool backward =
          line.time_s && !kept.empty() && kept.back().time_s && *line.time_s < *kept.back().time_s;
      if (!backward) kept.push_back(line);
    }
    log.used = kept.size();
    const std::size_t dropped = lines.size() - kept.size();
    log.unusable += dropped;
    if (dropped > 0)
      log.notes.push_back(fmt::format("{} lines whose time goes backward are left out", dropped));
    return kept;
  }

  void note_lock(RecordedLog& log) const {
    constexpr int kLocked = 2;
    const auto first = std::find_if(lines_.begin(), lines_.end(),
                                    [](const OffsetLogLine& l) { return l.state >= kLocked; });
    if (first != lines_.end()) log.locked_from = static_cast<std::size_t>(first - lines_.begin());
  }

  void rebuild(RecordedLog& log) {
    note_lock(log);
    const bool free_running = std::all_of(lines_.begin(), lines_.end(),
                                          [](const OffsetLogLine& l) { return l.state == 0; });
    std::vector<std::optional<double>> times;
    for (const OffsetLogLine& line : lines_) times.push_back(line.time_s);
    const std::vector<double> steps_s = intervals(times, log);
    log.steered = !free_running;
    log.replay_notes.emplace_back(
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

  /// Without the summaries of the time before the program steered, whose frequency of zero says
  /// nothing of the oscillator, and without the one in which it began.
  static std::vector<SummaryLogLine> steered(std::vector<SummaryLogLine> lines, RecordedLog& log) {
    auto first = std::find_if(lines.begin(), lines.end(), [](const SummaryLogLine& line) {
      return line.frequency_ppb != 0.0 || line.frequency_spread_ppb != 0.0;
    });
    constexpr std::ptrdiff_t kFewest = 3;
    if (first == lines.begin() || lines.end() - first <= kFewest) return lines;
    ++first;
    const auto dropped = static_cast<std::size_t>(first - lines.begin());
    log.used -= dropped;
    log.unusable += dropped;
    log.notes.push_back(
        fmt::format("{} summaries of the time before the clock was steered are left out", dropped));
    lines.erase(lines.begin(), first);
    return lines;
  }

  /// Whether the magnitude of the offset goes where the frequency, then a measurement, says: who
  /// steers removes the offset and does not let it grow.
  static bool ran_freely(const std::vector<SummaryLogLine>& lines,
                         const std::vector<double>& steps_s) {
    constexpr double kShare = 0.25;
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const double grown_ns = std::abs(lines[i].rms_ns - lines[i - 1].rms_ns);
      const double said_ns = std::abs(lines[i].frequency_ppb * steps_s[i - 1]);
      if (said_ns == 0.0 || std::abs(grown_ns - said_ns) > kShare * said_ns) return false;
    }
    return lines.size() > 2;
  }

  /// Of summaries: the oscillator is the sum of the rates that were applied, or measured; how far
  /// off the clock was is known in magnitude alone.
  void rebuild(const std::vector<SummaryLogLine>& summaries, RecordedLog& log) {
    std::vector<std::optional<double>> times;
    times.reserve(summaries.size());
    for (const SummaryLogLine& line : summaries) times.push_back(line.time_s);
    const std::vector<double> steps_s = intervals(times, log);
    log.steered = !ran_freely(summaries, steps_s);
    log.replay_notes.emplace_back(fmt::format(
        "summaries (rms, max) hold no single offsets: the free-running clock is rebuilt from the "
        "{} frequency alone",
        log.steered ? "applied" : "measured"));
    log.replay_notes.emplace_back(fmt::format(
        "so each servo meets the wander of the oscillator without the noise of the messages: its "
        "figures are lower limits{}",
        log.steered ? ", and only the row \"as recorded\" is what the log says"
                    : "; the offset grows as the frequency says: nobody steered the clock"));
    Duration reference{};
    double x_ns = 0.0;
    for (std::size_t i = 0; i < summaries.size(); ++i) {
      if (i > 0) {
        reference += Duration::from_ns(steps_s[i - 1] * 1e9);
        x_ns += summaries[i].frequency_ppb * steps_s[i - 1];
      }
      log.pairs.push_back(offset_pair(reference, Duration::from_ns(x_ns), -x_ns));
      log.summaries.push_back({summaries[i].rms_ns, summaries[i].max_ns});
    }
  }

  /// How much the free-running clock gained between lines i - 1 and i. The printed frequency is how
  /// fast the program takes the oscillator to be; it runs the clock slower by as much.
  [[nodiscard]] double change_ns(std::size_t i, double dt_s) const {
    const OffsetLogLine& before = lines_[i - 1];
    const double start_ns = before.state == 1 ? 0.0 : before.offset_ns;
    return lines_[i].offset_ns - start_ns + *before.frequency_ppb * dt_s;
  }

  [[nodiscard]] static std::vector<double> intervals(
      const std::vector<std::optional<double>>& times, RecordedLog& log) {
    std::vector<double> steps;
    bool timed = true;
    for (std::size_t i = 1; i < times.size(); ++i) {
      timed = timed && times[i] && times[i - 1];
      steps.push_back(timed ? *times[i] - *times[i - 1] : 1.0);
    }
    if (!timed || steps.empty()) {
      log.timed = false;
      log.replay_notes.emplace_back("lines without a time: one second between them is assumed");
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
  // Start-up messages come before the first offset.
  if (!parse_offset_log_line(line) && !parse_summary_log_line(line)) return nullptr;
  return std::make_unique<LinuxptpLog>();
}

}  // namespace ftcs
