// SPDX-License-Identifier: MIT
#include "ftcs/sim/two_way.h"

#include <cmath>

#include "ftcs/sim/event_queue.h"
#include "ftcs/sim/node.h"
#include "ftcs/sim/random.h"

namespace ftcs::sim {
namespace {

enum class EventKind : std::uint8_t {
  kCycle,  ///< a new interval begins at a node's upstream: Sync leaves, the request is planned
  kSyncArrives,  ///< pair.reference is set
  kRequestLeaves,
  kRequestArrives,  ///< pair.free_running is set
  kPairKnown,       ///< a backward pair is complete
  kTruth,
};

struct Event {
  EventKind kind = EventKind::kTruth;
  std::size_t node = 0;
  EventPair pair{};
};

class TwoWayRun {
 public:
  TwoWayRun(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer)
      : spec_(spec), observer_(observer), reference_(spec.reference_steps, spec.reference_tick) {
    for (std::size_t i = 0; i < spec.nodes.size(); ++i) {
      nodes_.push_back(std::make_unique<Node>(spec.nodes[i], seed, i));
      timing_.emplace_back(seed, "timing", i);
    }
    plan(seed);
  }

  void run() {
    while (!queue_.empty() && queue_.next_time() < end_) {
      const auto entry = queue_.pop();
      now_ = entry.time;
      handle(entry.event);
    }
  }

 private:
  void plan(std::uint64_t seed) {
    RandomStream phase(seed, "phase");
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double share = spec_.random_phase ? phase.uniform() : 0.0;
      const TrueTime first{Duration::from_ns(share * spec_.interval.ns())};
      if (i == 0) start_ = first;
      queue_.schedule(first, {EventKind::kCycle, i, {}});
    }
    end_ = start_ + Duration::from_ns(static_cast<double>(spec_.cycles) * spec_.interval.ns());
    queue_.schedule(start_, {EventKind::kTruth, 0, {}});
  }

  void handle(const Event& event) {
    switch (event.kind) {
      case EventKind::kCycle:
        return begin_cycle(event.node);
      case EventKind::kSyncArrives: {
        EventPair pair = event.pair;
        pair.free_running = node(event).stamp(now_);
        return feed(event.node, pair);
      }
      case EventKind::kRequestLeaves:
        return send_request(event.node);
      case EventKind::kRequestArrives: {
        EventPair pair = event.pair;
        pair.reference = upstream_stamp(event.node);
        return queue_.schedule(now_ + spec_.response_delay,
                               {EventKind::kPairKnown, event.node, pair});
      }
      case EventKind::kPairKnown:
        return feed(event.node, event.pair);
      case EventKind::kTruth:
        return look();
    }
  }

  Node& node(const Event& event) { return *nodes_[event.node]; }

  /// What the clock that node `index` follows writes into a message now.
  ReferenceTime upstream_stamp(std::size_t index) {
    if (index == 0) return reference_.stamp(now_);
    Node& upstream = *nodes_[index - 1];
    return ReferenceTime{upstream.clock.local_at(upstream.stamp(now_)).since_epoch()};
  }

  void begin_cycle(std::size_t index) {
    const double request_share = timing_[index].uniform();
    double length = 1.0;
    if (spec_.interval_spread > 1.0) {
      const double exponent = 2.0 * timing_[index].uniform() - 1.0;
      length = std::pow(spec_.interval_spread, exponent);
    }
    const Duration interval = spec_.interval_spread > 1.0
                                  ? Duration::from_ns(length * spec_.interval.ns())
                                  : spec_.interval;
    const EventPair pair{Direction::kForward, upstream_stamp(index), FreeRunningTime{}};
    const Arrivals arrivals = nodes_[index]->forward.send(now_);
    for (int copy = 0; copy < arrivals.count; ++copy) {
      queue_.schedule(arrivals.times[static_cast<std::size_t>(copy)],
                      {EventKind::kSyncArrives, index, pair});
    }
    if (spec_.two_way) {
      queue_.schedule(now_ + Duration::from_ns(request_share * interval.ns()),
                      {EventKind::kRequestLeaves, index, {}});
    }
    queue_.schedule(now_ + interval, {EventKind::kCycle, index, {}});
  }

  void send_request(std::size_t index) {
    Node& sender = *nodes_[index];
    const EventPair pair{Direction::kBackward, ReferenceTime{}, sender.stamp(now_)};
    const Arrivals arrivals = sender.backward.send(now_);
    // A request that arrives twice is answered twice; the receiver takes the first answer.
    if (arrivals.count == 0) return;
    queue_.schedule(arrivals.times[0], {EventKind::kRequestArrives, index, pair});
  }

  [[nodiscard]] double cycle() const noexcept { return (now_ - start_).ns() / spec_.interval.ns(); }
  double time_error_ns(Node& node) {
    return offset_from_reference(node.local_at(now_), reference_.at(now_)).ns();
  }

  void feed(std::size_t index, const EventPair& pair) {
    Node& receiver = *nodes_[index];
    const double error_ns = time_error_ns(receiver);
    const Telemetry telemetry = receiver.feed(now_, pair);
    observer_.on_pair({index, cycle(), now_.since_epoch().seconds(), error_ns, &telemetry});
  }

  void look() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Node& node = *nodes_[i];
      const Rate tracking = node.discipline.latest().tracking_rate * node.oscillator.rate_at(now_);
      observer_.on_truth({i, cycle(), now_.since_epoch().seconds(), time_error_ns(node),
                          tracking.ppb(), &node.discipline.latest()});
    }
    ++looks_;
    const double step_ns = spec_.interval.ns() / spec_.truth_per_cycle;
    queue_.schedule(start_ + Duration::from_ns(static_cast<double>(looks_) * step_ns),
                    {EventKind::kTruth, 0, {}});
  }

  const TwoWaySpec& spec_;
  TwoWayObserver& observer_;
  ReferenceClock reference_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<RandomStream> timing_;
  EventQueue<Event> queue_;
  TrueTime now_{};
  TrueTime start_{};
  TrueTime end_{};
  std::uint64_t looks_ = 0;
};

}  // namespace

void run_two_way(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer) {
  TwoWayRun(spec, seed, observer).run();
}

}  // namespace ftcs::sim
