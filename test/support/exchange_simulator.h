// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_01.hpp>

#include "ftcs/servo/servo.h"

// An oracle, and nothing else: a second simulator of two-way exchanges that shares no line with
// ftcs/sim, so that what both agree on is no mistake of either. Servos are tested against it where
// ftcs/sim stands above them; scenarios, networks and everything new belong to ftcs/sim.
//
// True time is the reference. The free-running clock has a frequency that is constant on a grid of
// an eighth of a sync interval T. A Sync leaves at t0 + n T, a Delay_Req once per T at a uniformly
// random phase; each packet takes `path_delay` plus noise. The forward pair reaches the servo at
// t2, the backward pair 20 us after t4. The local clock is an exact affine map of the free-running
// one and honours the expiry of a correction.
namespace ftcs::test {

enum class DelayNoise : std::uint8_t { kGaussian, kExponential };

struct ExchangeScenario {
  double interval_s = 1.0;
  int cycles = 1200;
  double initial_offset_ns = 1e6;
  double skew_ppm = 50.0;
  double path_delay_ns = 10'000.0;
  DelayNoise noise = DelayNoise::kGaussian;  ///< of both directions
  double noise_ns = 100.0;
  double forward_load_ns = 0.0;    ///< replaces the forward noise by an exponential of this mean
  double spike_probability = 0.0;  ///< per packet
  double spike_ns = 100'000.0;
  double stall_probability = 0.0;  ///< per packet: that it and the next ones come late
  int stall_packets = 0;           ///< of both directions, one after the other
  double stall_ns = 0.0;           ///< by this, each times 0.5 to 1.5
  double wander = 0.0;             ///< random walk of frequency, per sqrt(s)
  double square_ppm = 0.0;         ///< amplitude of a square wave of frequency
  double square_half_cycles = 50.0;
  double sine_ppm = 0.0;
  double sine_period_cycles = 75.0;
  double event_cycle = 800.0;      ///< when the two steps below happen (plus a random phase)
  double reference_step_ns = 0.0;  ///< the reference jumps forward
  double path_step_ns = 0.0;       ///< both directions become longer
  double outage_start_s = 0.0;
  double outage_end_s = 0.0;
  bool one_way = false;  ///< no Delay_Req at all
  double loss_probability = 0.0;
  double tick_ns = 0.0;  ///< local stamps are multiples of this (rounded down)
  double step_ns = 0.0;  ///< reference and steered clock show multiples of this (rounded down)
};

struct ExchangeResult {
  double c5_cycles = std::numeric_limits<double>::infinity();
  double rms_ns = 0.0;            ///< last half, true error
  double mean_ns = 0.0;           ///< last half
  double max_ns = 0.0;            ///< last half
  double outage_error_ns = 0.0;   ///< at the end of the outage
  double first_ten_rms_ns = 0.0;  ///< ten cycles from the first command + one cycle
  double event_max_ns = 0.0;      ///< from the event (steps excluded: from 3 cycles after) on
  double overshoot_ns = 0.0;      ///< beyond the new value after a reference step
  bool went_backward = false;
  int steps = 0;
  double inside_1 = 0.0, inside_2 = 0.0, inside_3 = 0.0;  ///< share within k reported sigma
  std::vector<float> trace;  ///< true error at every log instant, if asked for
};

/// Runs one servo through one scenario.
template <class Servo>
class ExchangeSimulator {
 public:
  ExchangeSimulator(const ExchangeScenario& scenario, Servo servo, std::uint64_t seed)
      : scenario_(scenario), servo_(servo), random_(seed), interval_(scenario.interval_s * 1e9) {}

  ExchangeResult run(bool keep_trace = false) {
    const double start = interval_ * uniform();
    const double square_phase = uniform();
    event_time_ = start + (scenario_.event_cycle + uniform()) * interval_;
    lead_ = scenario_.initial_offset_ns;
    wander_ppm_ = 0.0;
    local_lead_ = 0.0;
    const double grid = interval_ / 8.0;
    const std::int64_t ticks = static_cast<std::int64_t>(scenario_.cycles) * 8;
    next_sync_ = start;
    next_request_cycle_ = start;
    schedule_request();
    for (std::int64_t k = 0; k < ticks; ++k) {
      const double begin = static_cast<double>(k) * grid;
      deviation_ = frequency(begin, square_phase);
      if (scenario_.wander > 0.0) {
        wander_ppm_ += 1e6 * scenario_.wander * std::sqrt(grid * 1e-9) * gaussian();
      }
      // The free-running clock is affine until the end of this grid cell.
      process_events(begin + grid);
      advance(begin + grid);
      log(k, begin + grid, start, keep_trace);
    }
    finish();
    return result_;
  }

  Servo& servo() { return servo_; }
  ClockReading reading() const {
    return {FreeRunningTime{instant(now_, lead_)}, LocalTime{instant(now_, lead_ + local_lead_)}};
  }
  /// True offset of the steered clock now.
  double error_ns() const { return lead_ + local_lead_ - reference_lead_; }

 private:
  struct Pending {
    double arrival;
    TimestampPair pair;
  };

  double uniform() { return boost::random::uniform_01<double>{}(random_); }
  double gaussian() { return normal_(random_); }
  double exponential(double mean) { return -mean * std::log(1.0 - uniform()); }

  double frequency(double now, double phase) const {
    double ppm = scenario_.skew_ppm + wander_ppm_;
    const double cycle = now / interval_;
    if (scenario_.square_ppm != 0.0) {
      const double half = cycle / scenario_.square_half_cycles + phase;
      ppm += std::fmod(half, 2.0) < 1.0 ? scenario_.square_ppm : -scenario_.square_ppm;
    }
    if (scenario_.sine_ppm != 0.0) {
      ppm += scenario_.sine_ppm *
             std::sin(6.283185307179586 * (cycle / scenario_.sine_period_cycles + phase));
    }
    return ppm * 1e-6;
  }

  double delay(bool forward) {
    double noise = 0.0;
    if (forward && scenario_.forward_load_ns > 0.0) {
      noise = exponential(scenario_.forward_load_ns);
    } else if (scenario_.noise == DelayNoise::kGaussian) {
      noise = scenario_.noise_ns * gaussian();
    } else {
      noise = exponential(scenario_.noise_ns);
    }
    if (scenario_.spike_probability > 0.0 && uniform() < scenario_.spike_probability) {
      noise += scenario_.spike_ns;
    }
    if (stalled_ == 0 && scenario_.stall_probability > 0.0 &&
        uniform() < scenario_.stall_probability) {
      stalled_ = scenario_.stall_packets;
    }
    if (stalled_ > 0) {
      --stalled_;
      noise += scenario_.stall_ns * (0.5 + uniform());
    }
    return scenario_.path_delay_ns + noise + (path_stepped_ ? scenario_.path_step_ns : 0.0);
  }

  void schedule_request() {
    next_request_ = next_request_cycle_ + uniform() * interval_;
    next_request_cycle_ += interval_;
  }

  bool lost(double now) {
    const double seconds = now * 1e-9;
    if (seconds >= scenario_.outage_start_s && seconds < scenario_.outage_end_s) return true;
    return scenario_.loss_probability > 0.0 && uniform() < scenario_.loss_probability;
  }

  /// Moves both clocks to true time `to`.
  void advance(double to) {
    while (now_ < to) {
      double next = to;
      if (correction_left_ > 0.0) {
        const double expiry = now_ + correction_left_ / (1.0 + deviation_);
        if (expiry < next) next = expiry;
      }
      const double elapsed = next - now_;
      const double elapsed_free = elapsed * (1.0 + deviation_);
      local_lead_ += elapsed_free * rate_.deviation();
      if (rate_.ratio() <= 0.0) result_.went_backward = true;
      lead_ += elapsed * deviation_;
      if (correction_left_ > 0.0) {
        correction_left_ -= elapsed_free;
        if (next < to || correction_left_ <= 0.0) {
          correction_left_ = 0.0;
          rate_ = tracking_;
        }
      }
      now_ = next;
    }
  }

  static Duration instant(double ns, double lead) {
    constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;
    return Duration::from_whole_ns(kEpoch) + Duration::from_ns(ns) + Duration::from_ns(lead);
  }

  double rounded_off(double shown) const {
    return scenario_.step_ns > 0.0 ? std::fmod(shown, scenario_.step_ns) : 0.0;
  }
  Duration reference_stamp(double when) const {
    return instant(when, reference_lead_ - rounded_off(when + reference_lead_));
  }

  /// All but the reference's own stamp.
  TimestampPair stamp(Direction direction) const {
    TimestampPair pair;
    pair.direction = direction;
    double lost = rounded_off(now_ + lead_ + local_lead_);
    if (scenario_.tick_ns > 0.0) lost = std::fmod(now_ + lead_, scenario_.tick_ns);
    pair.free_running = FreeRunningTime{instant(now_, lead_ - lost)};
    pair.local = LocalTime{instant(now_, lead_ + local_lead_ - lost)};
    return pair;
  }

  void process_events(double until) {
    while (true) {
      if (!path_stepped_ && now_ >= event_time_) {
        path_stepped_ = true;
        reference_lead_ = scenario_.reference_step_ns;
      }
      enum { kSync, kRequest, kReceive, kRequestArrives, kReport, kNone } what = kNone;
      double when = until;
      const auto consider = [&](double t, auto w) {
        if (t < when) {
          when = t;
          what = w;
        }
      };
      consider(next_sync_, kSync);
      if (!scenario_.one_way) consider(next_request_, kRequest);
      if (sync_in_flight_) consider(sync_arrival_, kReceive);
      if (request_in_flight_) consider(request_arrival_, kRequestArrives);
      if (report_pending_) consider(report_time_, kReport);
      if (what == kNone) return;
      advance(std::max(when, now_));
      if (what == kSync) {
        next_sync_ += interval_;
        if (!lost(now_)) {
          sync_in_flight_ = true;
          sync_reference_ = reference_stamp(when);
          sync_arrival_ = when + delay(true);
        }
      } else if (what == kRequest) {
        request_ = stamp(Direction::kBackward);
        schedule_request();
        if (!lost(now_)) {
          request_in_flight_ = true;
          request_arrival_ = when + delay(false);
        }
      } else if (what == kReceive) {
        sync_in_flight_ = false;
        TimestampPair pair = stamp(Direction::kForward);
        pair.reference = ReferenceTime{sync_reference_};
        feed(pair);
      } else if (what == kRequestArrives) {
        request_in_flight_ = false;
        request_.reference = ReferenceTime{reference_stamp(when)};
        report_pending_ = true;
        report_time_ = when + 20'000.0;
        report_ = request_;
      } else {
        report_pending_ = false;
        feed(report_);
      }
    }
  }

  void feed(const TimestampPair& pair) {
    const ServoUpdate update = servo_.update(pair, reading());
    if (!update.has_command) return;
    const ServoCommand& command = update.command;
    if (command.step != Duration{}) {
      local_lead_ += command.step.ns();
      ++result_.steps;
    }
    tracking_ = command.tracking_rate;
    if (command.correction_time > Duration{}) {
      rate_ = command.correction_rate;
      correction_left_ = command.correction_time.ns() / command.tracking_rate.ratio();
    } else {
      rate_ = tracking_;
      correction_left_ = 0.0;
    }
    if (first_command_ < 0.0) first_command_ = now_;
  }

  void log(std::int64_t k, double now, double start, bool keep_trace) {
    const double error = lead_ + local_lead_ - reference_lead_;
    if (keep_trace) result_.trace.push_back(static_cast<float>(error));
    const std::int64_t half = static_cast<std::int64_t>(scenario_.cycles) * 4;
    // c5: start of the first stretch of 60 cycles inside 5 x noise.
    if (std::abs(error) >= 5.0 * std::max(scenario_.noise_ns, 1e-9)) {
      if (!settled_) inside_since_ = -1;
    } else if (inside_since_ < 0) {
      inside_since_ = k;
      settle_time_ = now;
    }
    if (!settled_ && inside_since_ >= 0 && k - inside_since_ >= 480) {
      settled_ = true;
      result_.c5_cycles = (settle_time_ - start) / interval_;
    }
    if (first_command_ >= 0.0 && now > first_command_ + interval_ &&
        now <= first_command_ + 11.0 * interval_) {
      early_.add(error);
    }
    const double seconds = now * 1e-9;
    if (scenario_.outage_end_s > 0.0 && seconds <= scenario_.outage_end_s) {
      result_.outage_error_ns = error;
    }
    if (path_stepped_ && now > event_time_ + 3.0 * interval_) {
      result_.event_max_ns = std::max(result_.event_max_ns, std::abs(error));
    }
    if (path_stepped_ && scenario_.reference_step_ns > 0.0) {
      result_.overshoot_ns = std::max(result_.overshoot_ns, error);
    }
    if (k < half) return;
    late_.add(error);
    result_.max_ns = std::max(result_.max_ns, std::abs(error));
    count_coverage(error);
  }

  void count_coverage(double error) {
    double sigma = servo_.snapshot().offset_sigma_ns;
    if constexpr (requires { servo_.snapshot_at(reading()); }) {
      sigma = servo_.snapshot_at(reading()).offset_sigma_ns;
    }
    if (!(sigma > 0.0)) return;
    covered_ += 1.0;
    result_.inside_1 += std::abs(error) <= sigma ? 1.0 : 0.0;
    result_.inside_2 += std::abs(error) <= 2.0 * sigma ? 1.0 : 0.0;
    result_.inside_3 += std::abs(error) <= 3.0 * sigma ? 1.0 : 0.0;
  }

  void finish() {
    result_.rms_ns = late_.rms();
    result_.mean_ns = late_.sum / std::max(late_.count, 1.0);
    result_.first_ten_rms_ns = early_.rms();
    const double n = std::max(covered_, 1.0);
    result_.inside_1 /= n;
    result_.inside_2 /= n;
    result_.inside_3 /= n;
  }

  struct Moments {
    double count = 0.0, sum = 0.0, squares = 0.0;
    void add(double value) {
      count += 1.0;
      sum += value;
      squares += value * value;
    }
    double rms() const { return count > 0.0 ? std::sqrt(squares / count) : 0.0; }
  };

  ExchangeScenario scenario_;
  Servo servo_;
  boost::random::mt19937_64 random_;
  boost::random::normal_distribution<double> normal_;
  double interval_;

  double now_ = 0.0;             // true time, ns
  double lead_ = 0.0;            // free running - true time
  double local_lead_ = 0.0;      // local - free running
  double reference_lead_ = 0.0;  // reference - true time: zero but for a step of the reference
  double deviation_ = 0.0;       // of the free-running clock
  double wander_ppm_ = 0.0;
  Rate rate_, tracking_;
  double correction_left_ = 0.0;  // free-running ns

  double next_sync_ = 0.0, next_request_ = 0.0, next_request_cycle_ = 0.0;
  bool sync_in_flight_ = false, request_in_flight_ = false, report_pending_ = false;
  double sync_arrival_ = 0.0, request_arrival_ = 0.0, report_time_ = 0.0;
  Duration sync_reference_{};
  TimestampPair request_{}, report_{};
  double event_time_ = 0.0;
  bool path_stepped_ = false;
  int stalled_ = 0;  ///< packets that are still to come late

  ExchangeResult result_;
  Moments early_, late_;
  double first_command_ = -1.0;
  std::int64_t inside_since_ = -1;
  double settle_time_ = 0.0;
  bool settled_ = false;
  double covered_ = 0.0;
};

}  // namespace ftcs::test
