// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "ftcs/sim/queueing.h"
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
/// A heavy tail (Lomax): P(extra > x) = (1 + x/scale)^-shape. The mean is scale / (shape - 1) for
/// shape > 1; access to a radio channel is like this.
struct ParetoJitter {
  double shape = 2.0;
  double scale_ns = 0.0;
};
/// Delays that somebody measured: packet n takes values[(start + n) mod size], so that what belongs
/// together in the record stays together; the seed chooses the start.
struct RecordedJitter {
  std::shared_ptr<const std::vector<double>> values_ns;
};
/// Independent draws from a table: value k with a probability in proportion to weights[k].
struct HistogramJitter {
  std::shared_ptr<const std::vector<double>> values_ns;
  std::shared_ptr<const std::vector<double>> cumulative;  ///< ascending, the last one is 1
};
using Jitter = std::variant<NoJitter, GaussianJitter, ExponentialJitter, GammaJitter, BimodalJitter,
                            ParetoJitter, RecordedJitter, HistogramJitter>;

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
/// The receiving host stands still at Poisson instants: a message that falls into a stall is
/// stamped at its end (software stamps on a busy machine). Exponential lengths.
struct HostStalls {
  double mean_interval_s = 1.0;  ///< from one stall's begin to the next one's
  double mean_length_ns = 0.0;
  bool shared = false;  ///< one host takes the stamps of both directions: the same stalls for both
};
/// A clock in a PHY or MAC slips by a step of its phase and back: stamps are late by half of
/// `peak_to_peak_ns` in the first half of each period and early by as much in the second. A mean
/// of zero; a variance of peak_to_peak_ns^2 / 4.
struct StampWave {
  double peak_to_peak_ns = 0.0;
  double period_s = 1.0;
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
  std::optional<HostStalls> stalls;
  std::optional<StampWave> wave;
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
  bool clean = true;  ///< nothing but jitter: no queue, burst, spike or stall was met
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
  [[nodiscard]] double burst_ns(TrueTime now);
  [[nodiscard]] double stall_ns(TrueTime arrival);
  [[nodiscard]] double wave_ns(TrueTime t) const;
  [[nodiscard]] Duration stall_gap();
  [[nodiscard]] bool in_outage(TrueTime now) const noexcept;

  LinkSpec spec_;
  QueueingPath queueing_;
  RandomStream jitter_;
  RandomStream load_;
  RandomStream fate_;
  RandomStream stall_;
  std::size_t packets_ = 0;
  std::size_t first_packet_ = 0;  ///< of a recorded jitter
  bool busy_ = false;             ///< state of the bursty load
  TrueTime burst_change_{};       ///< when it changes next
  TrueTime stall_begin_{};
  TrueTime stall_end_{};  ///< of the latest stall that has begun
  TrueTime next_stall_{};
  TrueTime last_arrival_{};
};

}  // namespace ftcs::sim
