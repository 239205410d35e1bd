// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_01.hpp>

#include "ftcs/time/per_direction.h"

// A world for tests of estimators: a clock with random-walk FM, and messages of both directions
// through switches that carry other traffic. It knows which messages waited, so that an oracle can
// be asked.
namespace ftcs::test {

/// Frames of one size arrive at random and share the line (M/D/1); a message waits for the work it
/// finds.
struct TrafficSpec {
  std::function<double(double seconds)> utilisation = [](double) { return 0.0; };
  double service_ns = 120e3;
  int hops = 1;
};
inline TrafficSpec traffic(double utilisation, int hops = 1, double service_ns = 120e3) {
  return {[utilisation](double) { return utilisation; }, service_ns, hops};
}

struct LoadedPathSpec {
  double interval_s = 0.125;
  int cycles = 4800;
  double jitter_ns = 20.0;
  double wander = 1e-9;  ///< random walk of frequency, per sqrt(s)
  double skew = 50e-6;
  double delay_ns = 10e3;
  PerDirection<TrafficSpec> traffic{};
  double event_s = -1.0;  ///< when the changes below happen
  double longer_path_ns = 0.0;
  double reference_step_ns = 0.0;
  double rate_step = 0.0;
  /// One message in so many of each direction is early by this; 0: none.
  double early_share = 0.0;
  double early_ns = 0.0;
};

struct PathMessage {
  Direction direction = Direction::kForward;
  double time_ns = 0.0;   ///< reference stamp
  double reading = 0.0;   ///< free running less reference, ns
  double heard_ns = 0.0;  ///< true time at which both stamps are known
  bool waited = false;
};

class LoadedPath {
 public:
  LoadedPath(const LoadedPathSpec& spec, std::uint64_t seed) : spec_(spec), random_(seed) {
    wander();
    send();
    std::sort(messages_.begin(), messages_.end(),
              [](const auto& a, const auto& b) { return a.heard_ns < b.heard_ns; });
  }
  [[nodiscard]] const std::vector<PathMessage>& messages() const { return messages_; }
  [[nodiscard]] double interval_ns() const { return spec_.interval_s * 1e9; }
  /// Free running less reference at a true time.
  [[nodiscard]] double offset_ns(double now) const {
    const double place = std::max(0.0, now / grid());
    const std::size_t k = std::min(static_cast<std::size_t>(place), offset_.size() - 2);
    const double part = place - static_cast<double>(k);
    return offset_[k] + (offset_[k + 1] - offset_[k]) * part - reference_lead(now);
  }

 private:
  /// One output of a switch.
  class Port {
   public:
    double wait(const TrafficSpec& spec, double now, LoadedPath& world) {
      const double u = spec.utilisation(now * 1e-9);
      if (u <= 0.0) return 0.0;
      const double memory = 20.0 * spec.service_ns / ((1.0 - u) * (1.0 - u));
      double left = now - time_;
      time_ = now;
      if (left > memory) {
        work_ = 0.0;
        left = memory;
      }
      for (;;) {
        const double next = -spec.service_ns / u * std::log(1.0 - world.uniform());
        if (next >= left) break;
        left -= next;
        work_ = std::max(0.0, work_ - next) + spec.service_ns;
      }
      return work_ = std::max(0.0, work_ - left);
    }

   private:
    double time_ = 0.0;
    double work_ = 0.0;
  };

  double uniform() { return boost::random::uniform_01<double>{}(random_); }
  double gaussian() { return normal_(random_); }
  [[nodiscard]] double grid() const { return interval_ns() / 16.0; }
  [[nodiscard]] bool changed(double now) const {
    return spec_.event_s >= 0.0 && now >= spec_.event_s * 1e9;
  }
  [[nodiscard]] double reference_lead(double now) const {
    return changed(now) ? spec_.reference_step_ns : 0.0;
  }

  void wander() {
    const double step = grid() * 1e-9;
    double rate = spec_.skew;
    double offset = 1e6;
    for (int k = 0; k < 16 * (spec_.cycles + 5); ++k) {
      offset_.push_back(offset);
      const double sudden = changed(k * grid()) ? spec_.rate_step : 0.0;
      offset += (rate + sudden) * grid();
      rate += spec_.wander * std::sqrt(step) * gaussian();
    }
  }

  void send() {
    PerDirection<std::vector<Port>> ports;
    for (const Direction direction : kDirections) {
      ports[direction].resize(static_cast<std::size_t>(spec_.traffic[direction].hops));
    }
    const double phase = uniform() * interval_ns();
    for (int cycle = 0; cycle < spec_.cycles; ++cycle) {
      for (const Direction direction : kDirections) {
        const bool forward = direction == Direction::kForward;
        const double sent = phase + (cycle + (forward ? 0.0 : uniform())) * interval_ns();
        double waited = 0.0;
        for (Port& port : ports[direction]) {
          waited += port.wait(spec_.traffic[direction], sent + waited, *this);
        }
        const bool early = spec_.early_share > 0.0 && uniform() < spec_.early_share;
        const double noise = spec_.jitter_ns * gaussian() + waited - (early ? spec_.early_ns : 0.0);
        const double arrival =
            sent + spec_.delay_ns + noise + (changed(sent) ? spec_.longer_path_ns : 0.0);
        const double reference = forward ? sent : arrival;  // t1, t4
        const double local = forward ? arrival : sent;      // t2, t3
        messages_.push_back({direction, reference + reference_lead(reference),
                             offset_ns(local) + reference_lead(local) + local - reference -
                                 reference_lead(reference),
                             forward ? arrival : arrival + 20e3, waited > 0.0});
      }
    }
  }

  LoadedPathSpec spec_;
  boost::random::mt19937_64 random_;
  boost::random::normal_distribution<double> normal_;
  std::vector<double> offset_;
  std::vector<PathMessage> messages_;
};

struct PathErrors {
  double rms_ns = 0.0;
  double largest_ns = 0.0;
  double last_above_ns = 0.0;  ///< true time of the last error above the given limit
  int count = 0;
};

/// Errors of an estimator, hear(message) and offset_ns(now), eight times a cycle from `from_cycle`.
template <class Estimator>
PathErrors errors_of(Estimator& estimator, const LoadedPath& path, double from_cycle,
                     double limit_ns = 5'000.0) {
  PathErrors errors;
  double squares = 0.0;
  double next = from_cycle * path.interval_ns();
  for (const PathMessage& message : path.messages()) {
    for (; next < message.heard_ns; next += path.interval_ns() / 8.0) {
      const double error = std::abs(estimator.offset_ns(next) - path.offset_ns(next));
      squares += error * error;
      errors.largest_ns = std::max(errors.largest_ns, error);
      if (error > limit_ns) errors.last_above_ns = next;
      ++errors.count;
    }
    estimator.hear(message);
  }
  errors.rms_ns = std::sqrt(squares / std::max(1, errors.count));
  return errors;
}

}  // namespace ftcs::test
