// SPDX-License-Identifier: MIT
#include "ftcs/sim/queueing.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace ftcs::sim {
namespace {

constexpr double kFullFrame = 1518.0;
/// The longest part of a frame that cannot be interrupted (IEEE 802.3br: 123 octets and the check).
constexpr double kFragment = 124.0 / kFullFrame;
/// Ports of one link draw from streams of their own; port 0 from that of the link itself.
constexpr std::uint64_t kStreamsPerPort = 1'000'000;

struct Length {
  double share;
  double octets;
};

/// {share, octets} of each length; the shares sum up to 1.
std::span<const Length> lengths_of(TrafficMix mix) {
  static constexpr Length kFull[] = {{1.0, kFullFrame}};
  static constexpr Length kModel1[] = {{0.80, 64.0}, {0.05, 576.0}, {0.15, kFullFrame}};
  static constexpr Length kModel2[] = {{0.30, 64.0}, {0.10, 576.0}, {0.60, kFullFrame}};
  switch (mix) {
    case TrafficMix::kFullFrames:
      break;
    case TrafficMix::kG8261Model1:
      return kModel1;
    case TrafficMix::kG8261Model2:
      return kModel2;
  }
  return kFull;
}

/// Mean length over that of a full frame.
double mean_length(TrafficMix mix) {
  double mean = 0.0;
  for (const Length& length : lengths_of(mix)) mean += length.share * length.octets / kFullFrame;
  return mean;
}

}  // namespace

QueueingPort::QueueingPort(const QueueingLoad& load, std::uint64_t seed, std::uint64_t index,
                           int hop)
    : load_(load),
      random_(seed, "link load", index + kStreamsPerPort * static_cast<std::uint64_t>(hop)),
      activity_(seed, "link activity", index + kStreamsPerPort * static_cast<std::uint64_t>(hop)) {}

double QueueingPort::utilisation_at(TrueTime now) {
  if (!load_.change) return load_.utilisation;
  const LoadChange& change = *load_.change;
  const double time_s = now.since_epoch().seconds();
  switch (change.kind) {
    case LoadChange::Kind::kStep:
      return time_s < change.period_s ? load_.utilisation : change.to;
    case LoadChange::Kind::kSquare:
      return std::fmod(time_s, 2.0 * change.period_s) < change.period_s ? load_.utilisation
                                                                        : change.to;
    case LoadChange::Kind::kRamp: {
      const double place = std::fmod(time_s, 2.0 * change.period_s) / change.period_s;
      return load_.utilisation +
             (change.to - load_.utilisation) * (place < 1.0 ? place : 2.0 - place);
    }
    case LoadChange::Kind::kOnOff:
      while (now >= activity_end_) {
        busy_ = !busy_;
        const double length_s =
            (busy_ ? change.mean_busy_s : change.mean_idle_s) * activity_.exponential();
        activity_end_ = activity_end_ + Duration::from_ns(std::max(length_s * 1e9, 1.0));
      }
      return busy_ ? change.to : load_.utilisation;
  }
  return load_.utilisation;
}

double QueueingPort::draw_service_ns() {
  if (load_.mix == TrafficMix::kFullFrames) return load_.service_ns;
  double pick = random_.uniform();
  for (const Length& length : lengths_of(load_.mix)) {
    if (pick < length.share) return load_.service_ns * length.octets / kFullFrame;
    pick -= length.share;
  }
  return load_.service_ns;
}

double QueueingPort::work_found_ns(TrueTime now, double utilisation) {
  // A queue forgets within about service/(1 - utilisation)^2; starting empty this many of those ago
  // is stationary.
  constexpr double kWarmUp = 20.0;
  const double idle = 1.0 - utilisation;
  const double memory_ns = kWarmUp * load_.service_ns / (idle * idle);
  const double gap_ns = (now - time_).ns();
  double remaining_ns = std::min(gap_ns, memory_ns);
  if (gap_ns > memory_ns) work_ns_ = 0.0;
  const double mean_gap_ns = load_.service_ns * mean_length(load_.mix) / utilisation;
  for (;;) {
    const double next_ns = mean_gap_ns * random_.exponential();
    if (next_ns >= remaining_ns) break;
    remaining_ns -= next_ns;
    work_ns_ = std::max(0.0, work_ns_ - next_ns) + draw_service_ns();
  }
  work_ns_ = std::max(0.0, work_ns_ - remaining_ns);
  time_ = now;
  return work_ns_;
}

double QueueingPort::rest_of_frame_ns(double utilisation) {
  const double pick = random_.uniform();
  // The frame that is found under way is a long one more often than its share: by its length.
  double service_ns = load_.service_ns;
  double place = random_.uniform() * mean_length(load_.mix) * kFullFrame;
  for (const Length& length : lengths_of(load_.mix)) {
    if (place < length.share * length.octets) {
      service_ns = load_.service_ns * length.octets / kFullFrame;
      break;
    }
    place -= length.share * length.octets;
  }
  const double rest_ns = service_ns * random_.uniform();
  if (pick >= utilisation) return 0.0;
  return load_.scheduling == Scheduling::kPreemption
             ? std::min(rest_ns, kFragment * load_.service_ns)
             : rest_ns;
}

double QueueingPort::wait_ns(TrueTime now) {
  const double utilisation = utilisation_at(now);
  if (utilisation <= 0.0) return 0.0;
  return load_.scheduling == Scheduling::kFifo ? work_found_ns(now, utilisation)
                                               : rest_of_frame_ns(utilisation);
}

QueueingPath::QueueingPath(const std::optional<QueueingLoad>& load, std::uint64_t seed,
                           std::uint64_t index) {
  if (!load) return;
  for (int hop = 0; hop < load->hops; ++hop) ports_.emplace_back(*load, seed, index, hop);
}

double QueueingPath::wait_ns(TrueTime now) {
  double wait_ns = 0.0;
  for (QueueingPort& port : ports_) wait_ns += port.wait_ns(now + Duration::from_ns(wait_ns));
  return wait_ns;
}

}  // namespace ftcs::sim
