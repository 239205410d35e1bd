// SPDX-License-Identifier: MIT
#include "ftcs/record/recorded_log.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "ftcs/analysis/statistics.h"
#include "ftcs/record/fields.h"
#include "ftcs/record/log_formats.h"

namespace ftcs {
namespace {

/// Enough to see what is wrong with a file.
constexpr std::size_t kExamples = 5;

void sort_and_measure(RecordedLog& log) {
  std::stable_sort(log.pairs.begin(), log.pairs.end(),
                   [](const RecordedPair& a, const RecordedPair& b) {
                     return a.pair.free_running < b.pair.free_running;
                   });
  std::vector<double> intervals;
  const RecordedPair* previous = nullptr;
  for (const RecordedPair& entry : log.pairs) {
    log.has_truth = log.has_truth || entry.truth_ns.has_value();
    if (entry.pair.direction != Direction::kForward) continue;
    if (previous != nullptr)
      intervals.push_back((entry.pair.reference - previous->pair.reference).seconds());
    previous = &entry;
  }
  const double interval_s = upper_median(std::move(intervals));
  if (interval_s > 0.0) log.interval_s = interval_s;
}

/// The record tells the truth when a Sync came; a delay request was stamped some time later, when a
/// clock 20 ppm fast was elsewhere (5 us after 250 ms): interpolated there, unknown outside.
void interpolate_truth(RecordedLog& log) {
  const RecordedPair* before = nullptr;
  std::vector<RecordedPair*> open;
  for (RecordedPair& entry : log.pairs) {
    if (entry.pair.direction == Direction::kBackward) {
      if (before != nullptr) open.push_back(&entry);
      continue;
    }
    if (!entry.truth_ns) continue;
    for (RecordedPair* between : open) {
      const double span = (entry.pair.free_running - before->pair.free_running).ns();
      if (span <= 0.0) continue;
      const double part = (between->pair.free_running - before->pair.free_running).ns() / span;
      between->truth_ns = *before->truth_ns + part * (*entry.truth_ns - *before->truth_ns);
    }
    open.clear();
    before = &entry;
  }
}

}  // namespace

LogReader::LogReader() = default;
LogReader::~LogReader() = default;

void LogReader::add(std::string_view line, std::size_t number) {
  ++log_.lines;
  if (trimmed(line).empty()) return;
  if (!format_) {
    format_ = detect_format(line);
    if (!format_) {
      leave_out(line, number, "format not recognised yet");
      return;
    }
    if (format_->is_heading(line)) return;
  }
  if (const std::string complaint = format_->take(line); !complaint.empty()) {
    leave_out(line, number, complaint);
  } else {
    ++log_.used;
  }
}

void LogReader::leave_out(std::string_view line, std::size_t number, const std::string& why) {
  ++log_.unusable;
  if (log_.examples.size() < kExamples)
    log_.examples.push_back({number, why + ": " + quoted_excerpt(line)});
}

Result<RecordedLog, std::string> LogReader::finish(const std::string& source) {
  if (!format_)
    return std::string("no line of a known format (ptp4l, phc2sys, chrony, CSV with a heading)");
  if (auto complaint = log_.used > 0 ? format_->finish(log_, source) : ""; !complaint.empty())
    return complaint;
  log_.format = format_->name();
  sort_and_measure(log_);
  interpolate_truth(log_);
  if (log_.pairs.size() >= 3) return std::move(log_);
  std::string message =
      fmt::format("only {} usable lines of {}; three are needed", log_.used, log_.lines);
  if (!log_.examples.empty())
    message +=
        fmt::format("; line {}: {}", log_.examples.front().number, log_.examples.front().text);
  return message;
}

Result<RecordedLog, ReadError> read_recorded_log(const std::string& path,
                                                 const std::string& source) {
  auto opened = LineReader::open(path);
  if (!opened) return opened.error();
  LogReader log;
  while (const auto line = opened->next()) log.add(*line, opened->line_number());
  if (opened->error()) return *opened->error();
  auto read = log.finish(source);
  if (!read) return ReadError{path, 0, read.error()};
  return std::move(*read);
}

}  // namespace ftcs
