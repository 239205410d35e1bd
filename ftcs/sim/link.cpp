// SPDX-License-Identifier: MIT
#include "ftcs/sim/link.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ftcs::sim {

Link::Link(LinkSpec spec, std::uint64_t seed, std::uint64_t index)
    : spec_(std::move(spec)),
      jitter_(seed, "link jitter", index),
      load_(seed, "link load", index),
      fate_(seed, "link fate", index) {}

double Link::jitter_ns() {
  struct Draw {
    RandomStream& random;
    double operator()(const NoJitter&) const { return 0.0; }
    double operator()(const GaussianJitter& j) const { return j.sigma_ns * random.normal(); }
    double operator()(const ExponentialJitter& j) const { return j.mean_ns * random.exponential(); }
    double operator()(const GammaJitter& j) const { return j.scale_ns * random.gamma(j.shape); }
    double operator()(const BimodalJitter& j) const {
      const double pick = random.uniform();
      const double noise = j.sigma_ns * random.normal();
      return noise + (pick < j.probability ? j.extra_ns : 0.0);
    }
  };
  return std::visit(Draw{jitter_}, spec_.jitter);
}

double Link::queueing_ns(TrueTime now) {
  if (!spec_.queueing) return 0.0;
  const QueueingLoad& load = *spec_.queueing;
  if (load.utilisation <= 0.0) return 0.0;
  // A queue forgets within about service/(1 - utilisation)^2; starting empty this many of those ago
  // is stationary.
  constexpr double kWarmUp = 20.0;
  const double idle = 1.0 - load.utilisation;
  const double memory_ns = kWarmUp * load.service_ns / (idle * idle);
  const double gap_ns = (now - load_time_).ns();
  double remaining_ns = std::min(gap_ns, memory_ns);
  if (gap_ns > memory_ns) work_ns_ = 0.0;
  const double mean_gap_ns = load.service_ns / load.utilisation;
  for (;;) {
    const double next_ns = mean_gap_ns * load_.exponential();
    if (next_ns >= remaining_ns) break;
    remaining_ns -= next_ns;
    work_ns_ = std::max(0.0, work_ns_ - next_ns) + load.service_ns;
  }
  work_ns_ = std::max(0.0, work_ns_ - remaining_ns);
  load_time_ = now;
  return work_ns_;
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

Arrivals Link::send(TrueTime departure) {
  double noise_ns = jitter_ns();
  noise_ns += queueing_ns(departure);
  noise_ns += burst_ns(departure);
  const bool spike = fate_.chance(spec_.spikes.probability);
  const bool lost = fate_.chance(spec_.loss);
  const bool copied = fate_.chance(spec_.duplication);
  const bool held = fate_.chance(spec_.reordering);
  if (spike) noise_ns += spec_.spikes.extra_ns;
  Duration delay = fixed_delay_at(departure) + Duration::from_ns(noise_ns);
  if (held) delay += spec_.reordering_hold;
  if (lost || in_outage(departure)) return {};

  TrueTime arrival = departure + std::max(delay, Duration{});
  if (spec_.in_order) arrival = std::max(arrival, last_arrival_);
  last_arrival_ = std::max(last_arrival_, arrival);
  Arrivals arrivals;
  arrivals.times[0] = arrival;
  arrivals.times[1] = arrival + spec_.duplicate_lag;
  arrivals.count = copied ? 2 : 1;
  return arrivals;
}

}  // namespace ftcs::sim
