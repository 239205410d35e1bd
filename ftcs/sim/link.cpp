// SPDX-License-Identifier: MIT
#include "ftcs/sim/link.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ftcs::sim {

Link::Link(LinkSpec spec, std::uint64_t seed, std::uint64_t index)
    : spec_(std::move(spec)),
      queueing_(spec_.queueing, seed, index),
      jitter_(seed, "link jitter", index),
      // Bursts alone: a queue's draws are its ports' own.
      load_(seed, "link load", index),
      fate_(seed, "link fate", index),
      // Links 2n and 2n + 1 are the two directions of one host.
      stall_(seed, "host stalls", spec_.stalls && spec_.stalls->shared ? index / 2 * 2 : index) {
  if (spec_.stalls) next_stall_ = TrueTime{} + stall_gap();
  if (const auto* recorded = std::get_if<RecordedJitter>(&spec_.jitter)) {
    RandomStream start(seed, "record start", index);
    first_packet_ = static_cast<std::size_t>(start.uniform() *
                                             static_cast<double>(recorded->values_ns->size()));
  }
}

double Link::jitter_ns() {
  struct Draw {
    RandomStream& random;
    std::size_t packet;
    double operator()(const NoJitter&) const { return 0.0; }
    double operator()(const GaussianJitter& j) const { return j.sigma_ns * random.normal(); }
    double operator()(const ExponentialJitter& j) const { return j.mean_ns * random.exponential(); }
    double operator()(const GammaJitter& j) const { return j.scale_ns * random.gamma(j.shape); }
    double operator()(const BimodalJitter& j) const {
      const double pick = random.uniform();
      const double noise = j.sigma_ns * random.normal();
      return noise + (pick < j.probability ? j.extra_ns : 0.0);
    }
    double operator()(const ParetoJitter& j) const {
      return j.scale_ns * (std::pow(1.0 - random.uniform(), -1.0 / j.shape) - 1.0);
    }
    double operator()(const RecordedJitter& j) const {
      return (*j.values_ns)[packet % j.values_ns->size()];
    }
    double operator()(const HistogramJitter& j) const {
      const double pick = random.uniform();
      const auto place = std::upper_bound(j.cumulative->begin(), j.cumulative->end(), pick);
      const auto index = std::min<std::ptrdiff_t>(
          place - j.cumulative->begin(), static_cast<std::ptrdiff_t>(j.values_ns->size()) - 1);
      return (*j.values_ns)[static_cast<std::size_t>(index)];
    }
  };
  return std::visit(Draw{jitter_, first_packet_ + packets_++}, spec_.jitter);
}

double Link::burst_ns(TrueTime now) {
  if (!spec_.bursts) return 0.0;
  const BurstyLoad& load = *spec_.bursts;
  while (now >= burst_change_) {
    const bool first = burst_change_ == TrueTime{};  // a run begins with an idle time
    busy_ = !first && !busy_;
    const double length_s = (busy_ ? load.mean_busy_s : load.mean_idle_s) * load_.exponential();
    burst_change_ = burst_change_ + Duration::from_ns(std::max(length_s * 1e9, 1.0));
  }
  const double extra = load_.exponential();
  return busy_ ? load.extra_mean_ns * extra : 0.0;
}

double Link::stall_ns(TrueTime arrival) {
  if (!spec_.stalls) return 0.0;
  while (arrival >= next_stall_) {
    // Of stalls that overlap the host wakes up after the last.
    if (next_stall_ > stall_end_) stall_begin_ = next_stall_;
    const double length_ns = spec_.stalls->mean_length_ns * stall_.exponential();
    stall_end_ = std::max(stall_end_, next_stall_ + Duration::from_ns(length_ns));
    next_stall_ = next_stall_ + stall_gap();
  }
  const bool inside = arrival >= stall_begin_ && arrival < stall_end_;
  return inside ? (stall_end_ - arrival).ns() : 0.0;
}

Duration Link::stall_gap() {
  const double gap_ns = spec_.stalls->mean_interval_s * 1e9 * stall_.exponential();
  return Duration::from_ns(std::max(gap_ns, 1.0));
}

bool Link::in_outage(TrueTime now) const noexcept {
  return std::any_of(spec_.outages.begin(), spec_.outages.end(), [&](const Outage& outage) {
    return now.since_epoch() >= outage.from && now.since_epoch() < outage.to;
  });
}

Duration Link::fixed_delay_at(TrueTime t) const noexcept {
  Duration delay = spec_.delay;
  for (const DelayStep& step : spec_.delay_steps) {
    if (t.since_epoch() >= step.at) delay += step.extra;
  }
  return delay;
}

double Link::wave_ns(TrueTime t) const {
  if (!spec_.wave) return 0.0;
  const double periods = t.since_epoch().seconds() / spec_.wave->period_s;
  const bool late = periods - std::floor(periods) < 0.5;
  return (late ? 0.5 : -0.5) * spec_.wave->peak_to_peak_ns;
}

Arrivals Link::send(TrueTime departure) {
  double noise_ns = jitter_ns();
  const double load_ns = queueing_.wait_ns(departure) + burst_ns(departure);
  noise_ns += load_ns;
  const bool spike = fate_.chance(spec_.spikes.probability);
  const bool lost = fate_.chance(spec_.loss);
  const bool copied = fate_.chance(spec_.duplication);
  const bool held = fate_.chance(spec_.reordering);
  if (spike) noise_ns += spec_.spikes.extra_ns;
  noise_ns += wave_ns(departure);
  Duration delay = fixed_delay_at(departure) + Duration::from_ns(noise_ns);
  if (held) delay += spec_.reordering_hold;
  if (lost || in_outage(departure)) return {};

  TrueTime arrival = departure + std::max(delay, Duration{});
  const double stall = stall_ns(arrival);
  arrival = arrival + Duration::from_ns(stall);
  if (spec_.in_order) arrival = std::max(arrival, last_arrival_);
  last_arrival_ = std::max(last_arrival_, arrival);
  Arrivals arrivals;
  arrivals.times[0] = arrival;
  arrivals.times[1] = arrival + spec_.duplicate_lag;
  arrivals.count = copied ? 2 : 1;
  arrivals.clean = load_ns == 0.0 && !spike && !held && stall == 0.0;
  return arrivals;
}

}  // namespace ftcs::sim
