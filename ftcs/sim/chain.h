// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "ftcs/sim/node.h"
#include "ftcs/sim/random.h"
#include "ftcs/sim/two_way.h"
#include "ftcs/time/relabel.h"

namespace ftcs::sim {

/// The reference and the chain of clocks behind it, with the truth about them. What the messages
/// between them are made of, and who steers the clocks, is for others (TwoWayRun: stamps alone into
/// a discipline; PtpRun: octets into the node that ships).
class Chain {
 public:
  Chain(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer)
      : spec_(spec), observer_(observer), reference_(spec.reference_steps, spec.reference_tick) {
    for (std::size_t i = 0; i < spec.nodes.size(); ++i) {
      nodes_.push_back(std::make_unique<Node>(spec.nodes[i], seed, i));
    }
    RandomStream phase(seed, "phase");
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double share = spec.random_phase ? phase.uniform() : 0.0;
      phases_.emplace_back(Duration::from_ns(share * spec.interval.ns()));
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }
  [[nodiscard]] Node& node(std::size_t index) noexcept { return *nodes_[index]; }
  /// When the clock that node `index` follows sends its first Sync.
  [[nodiscard]] TrueTime phase(std::size_t index) const noexcept { return phases_[index]; }
  [[nodiscard]] TrueTime start() const noexcept { return phases_.front(); }
  [[nodiscard]] TrueTime end() const noexcept {
    return start() + Duration::from_ns(static_cast<double>(spec_.cycles) * spec_.interval.ns());
  }
  /// Instant of the n-th look at the truth.
  [[nodiscard]] TrueTime look_time(std::uint64_t n) const noexcept {
    const double step_ns = spec_.interval.ns() / spec_.truth_per_cycle;
    return start() + Duration::from_ns(static_cast<double>(n) * step_ns);
  }

  /// What the clock that node `index` follows writes into a message at t.
  [[nodiscard]] ReferenceTime upstream_stamp(std::size_t index, TrueTime t) {
    if (index == 0) return reference_.stamp(t);
    Node& upstream = *nodes_[index - 1];
    return relabel<ReferenceTime>(upstream.clock.local_at(upstream.stamp(t)));
  }

  /// True error of a node's clock: local minus reference.
  [[nodiscard]] double time_error_ns(std::size_t index, TrueTime t) {
    return offset_from_reference(nodes_[index]->local_at(t), reference_.at(t)).ns();
  }

  /// Shows what came of one message. `error_ns`: true, before it was steered.
  void show(std::size_t index, TrueTime t, double error_ns, const Telemetry& telemetry,
            bool paces = true) {
    observer_.on_pair({index, cycle(t), t.since_epoch().seconds(), error_ns, &telemetry, paces});
  }

  /// Shows the truth about every clock. `latest(index)`: the telemetry of who steers it.
  template <class Latest>
  void look(TrueTime t, const Latest& latest) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const Telemetry& telemetry = latest(i);
      const Rate tracking = telemetry.tracking_rate * nodes_[i]->oscillator.state_at(t).rate;
      observer_.on_truth({i, cycle(t), t.since_epoch().seconds(), time_error_ns(i, t),
                          tracking.ppb(), &telemetry});
    }
  }

 private:
  [[nodiscard]] double cycle(TrueTime t) const noexcept {
    return (t - start()).ns() / spec_.interval.ns();
  }

  const TwoWaySpec& spec_;
  TwoWayObserver& observer_;
  ReferenceClock reference_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<TrueTime> phases_;
};

}  // namespace ftcs::sim
