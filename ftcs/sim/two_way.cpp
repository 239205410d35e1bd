// SPDX-License-Identifier: MIT
#include "ftcs/sim/two_way.h"

#include <cmath>
#include <deque>

#include "ftcs/sim/chain.h"
#include "ftcs/sim/event_queue.h"
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
      : spec_(spec), chain_(spec, seed, observer) {
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      timing_.emplace_back(seed, "timing", i);
      disciplines_.emplace_back(spec.nodes[i].discipline, chain_.node(i).clock);
      queue_.schedule(chain_.phase(i), {EventKind::kCycle, i, {}});
    }
    queue_.schedule(chain_.start(), {EventKind::kTruth, 0, {}});
  }

  void run() {
    while (!queue_.empty() && queue_.next_time() < chain_.end()) {
      const auto entry = queue_.pop();
      now_ = entry.time;
      handle(entry.event);
    }
  }

 private:
  void handle(const Event& event) {
    EventPair pair = event.pair;
    switch (event.kind) {
      case EventKind::kCycle:
        return begin_cycle(event.node);
      case EventKind::kSyncArrives:
        pair.free_running = chain_.node(event.node).stamp(now_);
        feed(event.node, pair);
        return;
      case EventKind::kRequestLeaves:
        return send_request(event.node);
      case EventKind::kRequestArrives:
        pair.reference = chain_.upstream_stamp(event.node, now_);
        return queue_.schedule(now_ + spec_.response_delay,
                               {EventKind::kPairKnown, event.node, pair});
      case EventKind::kPairKnown:
        feed(event.node, pair);
        return;
      case EventKind::kTruth:
        chain_.look(now_,
                    [this](std::size_t i) -> const Telemetry& { return disciplines_[i].latest(); });
        return queue_.schedule(chain_.look_time(++looks_), {EventKind::kTruth, 0, {}});
    }
  }

  void feed(std::size_t index, const EventPair& pair) {
    const double error_ns = chain_.time_error_ns(index, now_);
    chain_.node(index).set_time(now_);
    chain_.show(index, now_, error_ns, disciplines_[index].on_pair(pair));
  }

  /// The nominal interval, or one of a log-uniform spread around it.
  [[nodiscard]] Duration draw_interval(std::size_t index) {
    if (spec_.interval_spread <= 1.0) return spec_.interval;
    const double exponent = 2.0 * timing_[index].uniform() - 1.0;
    return Duration::from_ns(std::pow(spec_.interval_spread, exponent) * spec_.interval.ns());
  }

  [[nodiscard]] bool is_heard(const Arrivals& arrivals) const noexcept {
    return arrivals.count > 0 && (arrivals.clean || !spec_.clean_only);
  }

  void begin_cycle(std::size_t index) {
    const double request_share = timing_[index].uniform();
    const Duration interval = draw_interval(index);
    const EventPair pair{Direction::kForward, chain_.upstream_stamp(index, now_),
                         FreeRunningTime{}};
    const Arrivals arrivals = chain_.node(index).forward.send(now_);
    // The first copy alone: a PTP port takes each sequenceId once. run_ptp_network has the port
    // itself.
    if (is_heard(arrivals)) {
      queue_.schedule(arrivals.times[0], {EventKind::kSyncArrives, index, pair});
    }
    if (spec_.two_way) {
      queue_.schedule(now_ + Duration::from_ns(request_share * interval.ns()),
                      {EventKind::kRequestLeaves, index, {}});
    }
    queue_.schedule(now_ + interval, {EventKind::kCycle, index, {}});
  }

  void send_request(std::size_t index) {
    Node& sender = chain_.node(index);
    const EventPair pair{Direction::kBackward, ReferenceTime{}, sender.stamp(now_)};
    const Arrivals arrivals = sender.backward.send(now_);
    // A request that arrives twice is answered twice; the receiver takes the first answer.
    if (!is_heard(arrivals)) return;
    queue_.schedule(arrivals.times[0], {EventKind::kRequestArrives, index, pair});
  }

  const TwoWaySpec& spec_;
  Chain chain_;
  std::deque<ClockDiscipline> disciplines_;  ///< not copied, never moved
  std::vector<RandomStream> timing_;
  EventQueue<Event> queue_;
  TrueTime now_{};
  std::uint64_t looks_ = 0;
};

}  // namespace

void run_two_way(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer) {
  TwoWayRun(spec, seed, observer).run();
}

}  // namespace ftcs::sim
