// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/sim/link.h"
#include "ftcs/sim/oscillator.h"

namespace ftcs::sim {

/// The reference itself jumps: from `at` on it shows `size` more.
struct ReferenceStep {
  Duration at;
  Duration size;
};

/// A clock that follows its upstream neighbour: the next one in a chain of boundary clocks.
struct NodeSpec {
  OscillatorSpec oscillator;
  Duration initial_offset{};  ///< local minus reference at true time 0
  LinkSpec forward;           ///< upstream to here
  LinkSpec backward;
  Duration tick{};              ///< granularity of its timestamps; zero: exact
  double stamp_noise_ns = 0.0;  ///< white noise of its own timestamps, standard deviation
  RateLimits limits{};          ///< of its clock
  DisciplineConfig discipline;
};

/// A two-way exchange per interval along a chain of clocks. The first node follows the reference
/// (true time plus reference_steps), each further one the steered clock of the node before it.
///
/// Sync n leaves at t0 + nT, the delay request at t0 + (n + u_n) T, u_n uniform: the two directions
/// are not in phase. A forward pair is known when Sync arrives, a backward pair `response_delay`
/// after the request did.
struct TwoWaySpec {
  Duration interval = Nanoseconds{1'000'000'000};
  double interval_spread =
      1.0;  ///< > 1: each interval is T times a log-uniform factor in [1/spread, spread]
  Duration response_delay = Nanoseconds{20'000};
  Duration reference_tick{};  ///< granularity of the reference's timestamps
  bool random_phase = true;   ///< t0 uniform in one interval; false: t0 = 0
  bool two_way = true;        ///< false: no delay requests
  bool peer_to_peer = false;  ///< run_ptp_network: Pdelay exchanges with the neighbour instead
  /// The discipline hears only messages that met nothing but jitter: what an oracle would hear that
  /// knows which ones waited. The packets are the same.
  bool clean_only = false;
  std::uint64_t cycles = 0;
  int truth_per_cycle = 8;  ///< how often the truth is looked at
  std::vector<ReferenceStep> reference_steps;
  std::vector<NodeSpec> nodes;
};

/// The truth at one instant, which no clock knows.
struct TruthSample {
  std::size_t node = 0;
  double cycle = 0.0;          ///< nominal intervals since the first Sync left
  double time_s = 0.0;         ///< true time
  double time_error_ns = 0.0;  ///< local minus reference
  double tracking_error_ppb =
      0.0;  ///< rate of the clock once its correction has expired, against true time
  const Telemetry* latest = nullptr;  ///< of the node's discipline
};

/// What came of one message.
struct PairSample {
  std::size_t node = 0;
  double cycle = 0.0;
  double time_s = 0.0;
  double time_error_ns =
      0.0;  ///< true, when the message was handled, before the command took effect
  const Telemetry* telemetry = nullptr;
  bool paces = true;  ///< false: heard beside the Syncs, no sample of its own
};

class TwoWayObserver {
 public:
  virtual ~TwoWayObserver() = default;
  virtual void on_truth(const TruthSample&) {}
  virtual void on_pair(const PairSample&) {}

 protected:
  TwoWayObserver() = default;
  TwoWayObserver(const TwoWayObserver&) = default;
  TwoWayObserver& operator=(const TwoWayObserver&) = default;
};

/// Runs the world to its end. The same seed gives every discipline the same packets, oscillators
/// and instants. Memory does not depend on the number of cycles.
void run_two_way(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer);

}  // namespace ftcs::sim
