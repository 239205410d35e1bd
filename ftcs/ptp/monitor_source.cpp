// SPDX-License-Identifier: MIT
#include "ftcs/ptp/monitor_source.h"

#include "ftcs/ptp/sequence.h"

namespace ftcs::ptp {
namespace {

/// As a time receiver's own (kJumpTolerance): far above the noise of any clock that can be
/// followed, and half of the smallest jump that operators make. An eighth of the time between the
/// messages is added: any rate error is smaller.
constexpr Nanoseconds kTolerance{500'000'000};
/// More messages than that are not lost in a row: somebody started anew.
constexpr int kLargestGap = 64;

}  // namespace

MonitorReport MonitorSource::on_datagram(std::span<const std::uint8_t> bytes) noexcept {
  const auto report = decode_monitor(bytes);
  if (!report) {
    ++counters_.malformed;
    return {};
  }
  counters_.unknown_tlvs += report->unknown_tlvs;
  return *report;
}

std::optional<MonitorSource::Event> MonitorSource::on_sample(const MonitorSample& sample,
                                                             FreeRunningTime local) noexcept {
  Event event{{sample.direction, sample.reference, local}};
  if (!transmitter_ || *transmitter_ != sample.transmitter) {
    event.new_reference = transmitter_.has_value();
    if (event.new_reference) ++counters_.transmitter_changes;
    transmitter_ = sample.transmitter;
    forget();
  } else if (!in_order(sample)) {
    return std::nullopt;
  } else if (is_new_reference(event.pair)) {
    event.new_reference = true;
    ++counters_.reference_jumps;
    forget();
  }
  Last& last = last_of(sample.direction);
  if (sample.direction == Direction::kForward && last.known) {
    interval_ = sample.reference - last.pair.reference;
  }
  last = {true, sample.sequence_id, sample.local_ns, event.pair};
  ++(sample.direction == Direction::kForward ? counters_.syncs : counters_.delays);
  return event;
}

bool MonitorSource::in_order(const MonitorSample& sample) noexcept {
  const Last& last = last_of(sample.direction);
  if (!last.known) return true;
  const int distance = sequence_distance(sample.sequence_id, last.sequence_id);
  if (distance == 0 && sample.local_ns == last.local_ns) {
    ++counters_.repeated;
    return false;
  }
  if (distance <= 0 || distance > kLargestGap) {
    ++counters_.restarts;
  } else if (sample.direction == Direction::kForward) {
    counters_.missed_syncs += static_cast<std::uint64_t>(distance - 1);
  }
  return true;
}

bool MonitorSource::is_new_reference(const EventPair& pair) noexcept {
  const Last& last = last_of(pair.direction);
  if (!last.known) return false;
  const Duration elapsed = pair.free_running - last.pair.free_running;
  const Duration jump = (pair.reference - last.pair.reference) - elapsed;
  return abs(jump) > Duration{kTolerance} + abs(elapsed).half().half().half();
}

void MonitorSource::forget() noexcept {
  last_sync_ = {};
  last_delay_ = {};
  interval_.reset();
}

}  // namespace ftcs::ptp
