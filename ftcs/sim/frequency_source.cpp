// SPDX-License-Identifier: MIT
#include "ftcs/sim/frequency_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace ftcs::sim {
namespace {

/// Sixteen members spaced by four cover nine decades of time constants; what is slower than the run
/// is a constant.
constexpr int kFlickerMembers = 16;
constexpr double kFlickerSpacing = 4.0;

/// Share of [start, start + length) that lies after `at`.
double share_after(double at, double start, double length) {
  return std::clamp((start + length - at) / length, 0.0, 1.0);
}

/// Mean of sin(2 pi t / period + phase) over the cell.
double mean_sine(const FrequencySine& sine, double phase, double start, double length) {
  const double omega = 2.0 * std::numbers::pi / sine.period_seconds;
  const double middle = std::sin(omega * (start + 0.5 * length) + 2.0 * std::numbers::pi * phase);
  const double half = 0.5 * omega * length;
  return sine.amplitude * middle * (std::sin(half) / half);
}

/// Integral of the unit square wave (+1 in its first half period) from 0 to t >= 0.
double square_integral(double half, double t) {
  const double in_period = std::fmod(t, 2.0 * half);
  return in_period < half ? in_period : 2.0 * half - in_period;
}

/// Integral from minus infinity to t of a ramp from 0 at `from` to 1 at `to`.
double ramp_integral(double from, double to, double t) {
  if (t <= from) return 0.0;
  const double width = to - from;
  const double inside = std::min(t, to) - from;
  return 0.5 * inside * inside / width + std::max(t - to, 0.0);
}

/// Integral of a step function with the given interval from 0 to t; the last value stays.
double replay_integral(const ReplayedFrequency& replay, double start, double end) {
  const auto& values = *replay.deviations;
  if (values.empty()) return 0.0;
  const auto last = values.size() - 1;
  double sum = 0.0;
  double from = std::max(start, 0.0);
  while (from < end) {
    const auto index = std::min(last, static_cast<std::size_t>(from / replay.interval_seconds));
    const double to = index == last
                          ? end
                          : std::min(end, static_cast<double>(index + 1) * replay.interval_seconds);
    sum += values[index] * (to - from);
    // A cell boundary that rounding puts below `from` would never end.
    from = to > from ? to : end;
  }
  return sum;
}

}  // namespace

struct FrequencySource::Generator {
  FrequencyPart part;
  RandomStream random;
  double state = 0.0;  ///< phase of a periodic part, value of a random walk
  bool started = false;
  std::array<double, kFlickerMembers> members{};

  double next(double start, double length) {
    return std::visit([&](const auto& p) { return mean(p, start, length); }, part);
  }

 private:
  double mean(const ConstantSkew& p, double, double) { return p.deviation; }
  double mean(const Ageing& p, double start, double length) {
    return p.deviation_per_second * (start + 0.5 * length);
  }
  double mean(const FrequencyStep& p, double start, double length) {
    return p.deviation * share_after(p.at_seconds, start, length);
  }
  double mean(const FrequencySine& p, double start, double length) {
    if (!started) state = p.random_phase ? random.uniform() : p.phase_cycles;
    started = true;
    return mean_sine(p, state, start, length);
  }
  double mean(const FrequencySquare& p, double start, double length) {
    const double half = p.half_period_seconds;
    if (!started && p.random_phase) state = 2.0 * half * random.uniform();
    started = true;
    const double from = start + state;
    // Whole periods integrate to zero, so the difference of the periodic integrals is enough.
    return p.amplitude * (square_integral(half, from + length) - square_integral(half, from)) /
           length;
  }
  double mean(const FrequencyRamp& p, double start, double length) {
    const double to = ramp_integral(p.from_seconds, p.to_seconds, start + length);
    const double from = ramp_integral(p.from_seconds, p.to_seconds, start);
    return p.deviation * (to - from) / length;
  }
  double mean(const WhiteFm& p, double, double length) {
    return p.adev_1s * random.normal() / std::sqrt(length);
  }
  double mean(const RandomWalkFm& p, double, double length) {
    state += p.step_1s * std::sqrt(length) * random.normal();
    return state;
  }
  double mean(const ReplayedFrequency& p, double start, double length) {
    return replay_integral(p, start, start + length) / length;
  }
  double mean(const FlickerFm& p, double, double) {
    // S_y(f) = h/f is the integral over ln(tau) of Lorentzians of equal variance v: members spaced
    // by a factor r in tau have v = h ln(r) (one-sided density 4 v tau / (1 + (2 pi f tau)^2)
    // integrates to h/f).
    const double h = p.floor * p.floor / (2.0 * std::numbers::ln2);
    const double sigma = std::sqrt(h * std::log(kFlickerSpacing));
    double sum = 0.0;
    double tau = 0.25;  // cells; the fastest member fills the top of the band
    for (double& member : members) {
      const double draw = random.normal();
      const double keep = std::exp(-1.0 / tau);
      member = started ? keep * member + std::sqrt(1.0 - keep * keep) * sigma * draw : sigma * draw;
      sum += member;
      tau *= kFlickerSpacing;
    }
    started = true;
    return sum;
  }
};

FrequencySource::FrequencySource(std::vector<FrequencyPart> parts, std::uint64_t seed,
                                 std::uint64_t index) {
  generators_.reserve(parts.size());
  std::uint64_t part_index = 0;
  for (auto& part : parts) {
    constexpr std::uint64_t kPartsPerOscillator = 64;
    generators_.push_back(
        {std::move(part),
         RandomStream{seed, "oscillator", index * kPartsPerOscillator + part_index}});
    ++part_index;
  }
}
FrequencySource::~FrequencySource() = default;
FrequencySource::FrequencySource(FrequencySource&&) noexcept = default;
FrequencySource& FrequencySource::operator=(FrequencySource&&) noexcept = default;

double FrequencySource::next(double start_seconds, double length_seconds) {
  double sum = 0.0;
  for (auto& generator : generators_) sum += generator.next(start_seconds, length_seconds);
  return sum;
}

ReplayedFrequency replay_phase(const std::vector<double>& phase_seconds, double interval_seconds) {
  auto deviations = std::make_shared<std::vector<double>>();
  for (std::size_t i = 0; i + 1 < phase_seconds.size(); ++i) {
    deviations->push_back((phase_seconds[i + 1] - phase_seconds[i]) / interval_seconds);
  }
  return {interval_seconds, std::move(deviations)};
}

}  // namespace ftcs::sim
