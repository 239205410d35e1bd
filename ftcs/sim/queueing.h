// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ftcs/sim/random.h"
#include "ftcs/sim/true_time.h"

namespace ftcs::sim {

/// Lengths of the other packets on a line, as shares of a full frame (1,518 octets).
enum class TrafficMix : std::uint8_t {
  kFullFrames,
  kG8261Model1,  ///< ITU-T G.8261 VI.2.2: 80 % of 64, 5 % of 576, 15 % of 1,518 octets
  kG8261Model2,  ///< 30 % of 64, 10 % of 576, 60 % of 1,518 octets
};

/// Who goes first at a port.
enum class Scheduling : std::uint8_t {
  kFifo,        ///< our packet waits for all the work it finds
  kPriority,    ///< IEEE 802.1Q strict priority: only for the rest of the frame that is being sent
  kPreemption,  ///< IEEE 802.1Qbu: for the rest of a fragment, 124 octets at most
};

/// How the load of a port changes with time.
struct LoadChange {
  enum class Kind : std::uint8_t {
    kStep,    ///< from utilisation to `to` at `period_s`
    kSquare,  ///< utilisation and `to` in turn, `period_s` each
    kRamp,    ///< to `to` and back in straight lines, `period_s` each
    kOnOff,   ///< `to` during busy periods of exponential length, utilisation between them
  };
  Kind kind = Kind::kStep;
  double to = 0.0;
  double period_s = 1.0;
  double mean_idle_s = 1.0;  ///< of kOnOff
  double mean_busy_s = 0.1;
};

/// Store-and-forward ports in a row whose lines are shared: Poisson arrivals occupy a share
/// `utilisation` of each line (M/D/1, or M/G/1 with a mix of lengths). What our packet waits at a
/// port is the work it finds (Lindley's recursion), so that packets close together wait alike; the
/// ports' other traffic is independent. Valid: 0 <= utilisation < 1, hops >= 1.
struct QueueingLoad {
  double utilisation = 0.0;
  double service_ns = 12'000.0;  ///< of a full frame: 1 Gbit/s
  int hops = 1;
  TrafficMix mix = TrafficMix::kFullFrames;
  Scheduling scheduling = Scheduling::kFifo;
  std::optional<LoadChange> change{};
};

/// One port in use.
class QueueingPort {
 public:
  /// Port `hop` (from 0) of link `index`.
  QueueingPort(const QueueingLoad& load, std::uint64_t seed, std::uint64_t index, int hop);

  /// Time that a packet waits which comes at `now`, ns; packets must come in order of time.
  [[nodiscard]] double wait_ns(TrueTime now);

 private:
  [[nodiscard]] double utilisation_at(TrueTime now);
  [[nodiscard]] double draw_service_ns();
  [[nodiscard]] double work_found_ns(TrueTime now, double utilisation);
  [[nodiscard]] double rest_of_frame_ns(double utilisation);

  QueueingLoad load_;
  RandomStream random_;
  RandomStream activity_;  ///< of kOnOff: the same busy periods whatever the packets do
  TrueTime time_{};        ///< when work_ns_ was current
  double work_ns_ = 0.0;   ///< unfinished work in the queue
  bool busy_ = true;       ///< of kOnOff; a run begins with an idle period
  TrueTime activity_end_{};
};

/// The ports of one direction.
class QueueingPath {
 public:
  QueueingPath(const std::optional<QueueingLoad>& load, std::uint64_t seed, std::uint64_t index);

  /// Sum of the waits of a packet that enters at `now`, ns.
  [[nodiscard]] double wait_ns(TrueTime now);

 private:
  std::vector<QueueingPort> ports_;
};

}  // namespace ftcs::sim
