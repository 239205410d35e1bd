// SPDX-License-Identifier: MIT
#include "ftcs/record/log_series.h"

#include <cmath>
#include <cstddef>
#include <limits>

namespace ftcs {
namespace {

/// The recorded clock minus the reference, s, with the path delay of that direction in it.
double shown_s(const RecordedPair& entry) {
  const Duration ahead = entry.pair.free_running.since_epoch() - entry.pair.reference.since_epoch();
  return (ahead.ns() + entry.steering_ns) * 1e-9;
}

double distance_s(const RecordedPair& a, const RecordedPair& b) {
  return std::abs((a.pair.free_running - b.pair.free_running).seconds());
}

/// The backward message nearest to entry `at`; null: none within an interval.
const RecordedPair* nearest_backward(const RecordedLog& log, std::size_t at) {
  const RecordedPair& sync = log.pairs[at];
  const RecordedPair* nearest = nullptr;
  const auto look_at = [&](const RecordedPair& entry) {
    const bool too_far = distance_s(entry, sync) > log.interval_s;
    if (too_far || entry.pair.direction == Direction::kForward) return too_far;
    if (nearest == nullptr || distance_s(entry, sync) < distance_s(*nearest, sync))
      nearest = &entry;
    return true;
  };
  for (std::size_t i = at; i-- > 0 && !look_at(log.pairs[i]);) continue;
  for (std::size_t i = at + 1; i < log.pairs.size() && !look_at(log.pairs[i]); ++i) continue;
  return nearest;
}

double offset_s(const RecordedLog& log, std::size_t at) {
  if (!log.two_way) return shown_s(log.pairs[at]);
  const RecordedPair* back = nearest_backward(log, at);
  if (back == nullptr) return std::numeric_limits<double>::quiet_NaN();
  return 0.5 * (shown_s(log.pairs[at]) + shown_s(*back));
}

}  // namespace

RawSeries offsets_of(const RecordedLog& log) {
  RawSeries series;
  for (std::size_t i = log.locked_from; i < log.pairs.size(); ++i) {
    const EventPair& pair = log.pairs[i].pair;
    if (pair.direction != Direction::kForward) continue;
    series.values.push_back(offset_s(log, i));
    if (log.timed)
      series.times.push_back((pair.reference - log.pairs.front().pair.reference).seconds());
  }
  return series;
}

}  // namespace ftcs
