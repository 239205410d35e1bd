// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "ftcs/sim/random.h"
#include "ftcs/sim/true_time.h"

namespace ftcs::sim {

// Delay noise, per packet, in nanoseconds on top of the fixed delay.

struct NoJitter {};
struct GaussianJitter {
  double sigma_ns = 0.0;
};
struct ExponentialJitter {
  double mean_ns = 0.0;
};
/// shape * scale is the mean.
struct GammaJitter {
  double shape = 1.0;
  double scale_ns = 0.0;
};
/// A second path: with `probability` the packet takes `extra_ns` more; gaussian around both.
struct BimodalJitter {
  double probability = 0.5;
  double extra_ns = 0.0;
  double sigma_ns = 0.0;
};
using Jitter =
    std::variant<NoJitter, GaussianJitter, ExponentialJitter, GammaJitter, BimodalJitter>;

/// A store-and-forward hop whose line is shared: Poisson arrivals of packets of one service time
/// occupy a share `utilisation` of it (M/D/1). What our packet waits is the work it finds
/// (Lindley's recursion), so that packets close together wait alike. Valid: 0 <= utilisation < 1.
struct QueueingLoad {
  double utilisation = 0.0;
  double service_ns = 12'000.0;  ///< a full Ethernet frame at 1 Gbit/s
};
/// Load in bursts: exponentially distributed idle and busy times; while busy each packet takes an
/// exponential extra delay.
struct BurstyLoad {
  double mean_idle_s = 1.0;
  double mean_busy_s = 0.0;
  double extra_mean_ns = 0.0;
};
/// With `probability` a packet takes `extra_ns` more.
struct Spikes {
  double probability = 0.0;
  double extra_ns = 0.0;
};
/// From `at` on the delay is `extra` longer (or shorter).
struct DelayStep {
  Duration at;
  Duration extra;
};
/// Every packet sent in [from, to) is lost.
struct Outage {
  Duration from;
  Duration to;
};

/// One direction of a network path.
struct LinkSpec {
  Duration delay{};
  Jitter jitter{NoJitter{}};
  std::optional<QueueingLoad> queueing;
  std::optional<BurstyLoad> bursts;
  Spikes spikes{};
  double loss = 0.0;         ///< probability
  double duplication = 0.0;  ///< probability that a second copy arrives, later by `duplicate_lag`
  Duration duplicate_lag = Nanoseconds{1'000};
  double reordering = 0.0;  ///< probability that a packet is held back by `reordering_hold`
  Duration reordering_hold{};
  bool in_order = false;  ///< a packet never overtakes its predecessor
  std::vector<DelayStep> delay_steps;
  std::vector<Outage> outages;
};

/// Arrival times of one packet's copies: none (lost), one, or two.
struct Arrivals {
  std::array<TrueTime, 2> times{};
  int count = 0;
};

/// A link in use. Every packet draws the same kinds of numbers in the same order, lost or not, so
/// that packet n meets the same fate under every servo.
class Link {
 public:
  Link(LinkSpec spec, std::uint64_t seed, std::uint64_t index);

  /// Packets must be sent in order of time. A total delay below zero becomes zero.
  [[nodiscard]] Arrivals send(TrueTime departure);
  [[nodiscard]] const LinkSpec& spec() const noexcept { return spec_; }
  /// Delay without any noise at that time: what a perfect measurement would see.
  [[nodiscard]] Duration fixed_delay_at(TrueTime t) const noexcept;

 private:
  [[nodiscard]] double jitter_ns();
  [[nodiscard]] double queueing_ns(TrueTime now);
  [[nodiscard]] double burst_ns(TrueTime now);
  [[nodiscard]] bool in_outage(TrueTime now) const noexcept;

  LinkSpec spec_;
  RandomStream jitter_;
  RandomStream load_;
  RandomStream fate_;
  TrueTime load_time_{};     ///< when work_ns_ was current
  double work_ns_ = 0.0;     ///< unfinished work in the queue
  bool busy_ = false;        ///< state of the bursty load
  TrueTime burst_change_{};  ///< when it changes next
  TrueTime last_arrival_{};
};

}  // namespace ftcs::sim
