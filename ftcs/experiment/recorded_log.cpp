// SPDX-License-Identifier: MIT
#include "ftcs/experiment/recorded_log.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "ftcs/experiment/log_formats.h"
#include "ftcs/record/fields.h"

namespace ftcs::experiment {
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
  if (intervals.empty()) return;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  if (*middle > 0.0) log.interval_s = *middle;
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

Result<RecordedLog, ReadError> read_recorded_log(const std::string& path,
                                                 const std::string& source) {
  auto opened = LineReader::open(path);
  if (!opened) return opened.error();
  LineReader& reader = *opened;
  RecordedLog log;
  std::unique_ptr<LogFormat> format;
  while (const auto line = reader.next()) {
    ++log.lines;
    if (trimmed(*line).empty()) continue;
    if (!format) {
      format = detect_format(*line);
      if (!format) {
        ++log.unusable;
        if (log.examples.size() < kExamples) {
          log.examples.push_back(
              {reader.line_number(), "format not recognised yet: " + quoted_excerpt(*line)});
        }
        continue;
      }
      if (format->is_heading(*line)) continue;
    }
    const std::string complaint = format->take(*line);
    if (complaint.empty()) {
      ++log.used;
      continue;
    }
    ++log.unusable;
    if (log.examples.size() < kExamples) {
      log.examples.push_back({reader.line_number(), complaint + ": " + quoted_excerpt(*line)});
    }
  }
  if (reader.error()) return *reader.error();
  if (!format)
    return ReadError{path, 0,
                     "no line of a known format (ptp4l, phc2sys, chrony, CSV with a heading)"};
  if (auto complaint = log.used > 0 ? format->finish(log, source) : ""; !complaint.empty())
    return ReadError{path, 0, std::move(complaint)};
  log.format = format->name();
  sort_and_measure(log);
  interpolate_truth(log);
  if (log.pairs.size() < 3) {
    std::string message =
        fmt::format("only {} usable lines of {}; a replay needs three", log.used, log.lines);
    if (!log.examples.empty())
      message +=
          fmt::format("; line {}: {}", log.examples.front().number, log.examples.front().text);
    return ReadError{path, 0, std::move(message)};
  }
  return log;
}

}  // namespace ftcs::experiment
