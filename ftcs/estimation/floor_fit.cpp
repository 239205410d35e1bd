// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_fit.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/line_sums.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/estimation/wait_density.h"

namespace ftcs::estimation {
namespace {

constexpr std::size_t kCandidates = 48;
/// Cycles between the two messages of an edge, at least.
constexpr double kShortestEdge = 0.5;
constexpr int kRounds = 8;
constexpr double kRootTwoPi = 2.5066282746310002;

using Windows = PerDirection<RecordWindow>;

/// One candidate: the lines that touch both directions from below at one rate.
struct Candidate {
  double rate = 0.0;
  double score = -1e300;
  double width = 0.0;
  double mean = 0.0;     ///< height above the lines
  double highest = 0.0;  ///< the same, of the direction in which it is larger
  PerDirection<double> floor{};
};

/// Of one direction: messages that waited, and for how long in all.
struct Waits {
  double messages = 0.0;
  double ns = 0.0;
};

class Fit {
 public:
  Fit(const Windows& windows, double least_noise) noexcept
      : windows_(windows),
        smallest_(std::max(least_noise, kLeastNoise)),
        total_(static_cast<double>(windows.forward.size + windows.backward.size)),
        base_(windows.forward[windows.forward.size - 1].z) {}

  [[nodiscard]] FloorFit run() noexcept {
    FloorFit fit;
    find_candidate();
    if (!(best_.score > -1e299)) return fit;
    fit.estimate.y = best_.rate;
    fit.has_rate = true;
    start(fit);
    if (!settle(fit, false)) return fit;
    FloorFit drifting = fit;
    judge(fit);
    if (may_drift(fit) && settle(drifting, true) && may_drift(drifting)) {
      judge(drifting);
      const bool better = drifting.evidence > fit.evidence || !fit.found;
      if (drifting.found && better) fit = drifting;
    }
    fit.estimate.x += base_;
    return fit;
  }

 private:
  /// Height of a message above sign x + sign y t + d.
  [[nodiscard]] double height(Direction direction, const RecordedMessage& message, double rate,
                              double time) const noexcept {
    return sign_of(direction) * (message.z - base_ - rate * time);
  }

  void find_candidate() noexcept {
    for (const Direction direction : kDirections) try_edges(direction);
  }

  void try_edges(Direction direction) noexcept {
    const RecordWindow& window = windows_[direction];
    std::array<std::uint8_t, 128> hull;
    std::size_t size = 0;
    const auto slope = [&](std::size_t a, std::size_t b) {
      const double rise = sign_of(direction) * (window[b].z - window[a].z);
      return std::array<double, 2>{window.time(window[b]) - window.time(window[a]), rise};
    };
    for (std::size_t k = 0; k < window.size; ++k) {
      while (size >= 2) {
        const auto edge = slope(hull[size - 2], hull[size - 1]);
        const auto next = slope(hull[size - 2], k);
        if (edge[0] * next[1] - edge[1] * next[0] > 0.0) break;
        --size;
      }
      hull[size++] = static_cast<std::uint8_t>(k);
    }
    for (std::size_t k = 0; k + 1 < size && tried_ < kCandidates; ++k) {
      const auto edge = slope(hull[k], hull[k + 1]);
      if (edge[0] < kShortestEdge) continue;
      ++tried_;
      try_rate(sign_of(direction) * edge[1] / edge[0]);
    }
  }

  /// Octaves above `smallest_`, the first for all below.
  static constexpr int kOctaves = 48;
  using Counts = std::array<std::uint16_t, kOctaves>;

  [[nodiscard]] int octave_of(double height) const noexcept {
    if (!(height > smallest_)) return 0;
    const auto exponent = static_cast<int>(std::bit_cast<std::uint64_t>(height / smallest_) >> 52U);
    return std::min(kOctaves - 1, exponent - 1022);
  }

  void try_rate(double rate) noexcept {
    Candidate candidate;
    candidate.rate = rate;
    Counts count{};
    for (const Direction direction : kDirections) {
      const RecordWindow& window = windows_[direction];
      double least = 1e300;
      for (std::size_t k = 0; k < window.size; ++k) {
        const RecordedMessage& m = window[k];
        least = std::min(least, height(direction, m, rate, window.time(m)));
      }
      candidate.floor[direction] = least;
      double sum = 0.0;
      for (std::size_t k = 0; k < window.size; ++k) {
        const RecordedMessage& m = window[k];
        const double above = height(direction, m, rate, window.time(m)) - least;
        sum += above;
        ++count[static_cast<std::size_t>(octave_of(above))];
      }
      candidate.mean += sum / total_;
      candidate.highest = std::max(candidate.highest, sum / static_cast<double>(window.size));
    }
    score(count, candidate);
    if (candidate.score > best_.score) best_ = candidate;
  }

  /// ln likelihood of the best width: `inside` messages evenly within it, the
  /// others log-uniform or exponential, whichever is likelier.
  void score(const Counts& count, Candidate& candidate) const noexcept {
    const double log_unit = quick_log(kLogRange * smallest_);
    const auto unknown = [&](int octave) {  // ln density of a log-uniform wait
      return -((static_cast<double>(octave) - 0.5) * std::numbers::ln2 + log_unit);
    };
    double beyond = 0.0;
    for (int b = 1; b < kOctaves; ++b) beyond += count[static_cast<std::size_t>(b)] * unknown(b);
    double inside = 0.0;
    double width = smallest_;
    for (int b = 0; b < kOctaves; ++b) {
      const double here = count[static_cast<std::size_t>(b)];
      inside += here;
      if (b > 0) {
        beyond -= here * unknown(b);
        width *= 2.0;
      }
      if (inside < kRepeated || here == 0.0) continue;
      if (width > kSmallPart * candidate.highest && b > 1) break;
      const double rest = total_ - inside;
      double likelihood = inside * quick_log(inside / (total_ * width));
      if (rest > 0.0) {
        const double mean = candidate.mean * total_ / rest;
        const double exponential = -rest * (quick_log(mean) + 1.0);
        likelihood += rest * quick_log(rest / total_) + std::max(beyond, exponential);
      }
      if (likelihood > candidate.score) {
        candidate.score = likelihood;
        candidate.width = width;
      }
    }
  }

  void start(FloorFit& fit) const noexcept {
    const double sigma = std::max(smallest_, best_.width / 3.0);
    const double wait = std::max(best_.mean, smallest_);
    fit.noise = {{0.5, sigma, wait}, {0.5, sigma, wait}};
    fit.mean_wait = static_cast<float>(wait);
    fit.estimate.x = 0.5 * (best_.floor.forward - best_.floor.backward);
    fit.estimate.d = 0.5 * (best_.floor.forward + best_.floor.backward) + 1.5 * sigma;
  }

  [[nodiscard]] double innovation(const FloorFit& fit, Direction direction,
                                  const RecordedMessage& m, double time) const noexcept {
    return sign_of(direction) * (m.z - base_ - fit.offset_at(time)) - fit.estimate.d;
  }

  /// Messages wait, enough for four unknowns did not, and the waits are what is long.
  [[nodiscard]] bool may_drift(const FloorFit& fit) const noexcept {
    const bool clear = fit.clear(Direction::kForward) && fit.clear(Direction::kBackward);
    const double span = std::min(windows_.forward.oldest(), windows_.backward.oldest());
    return !clear && fit.members.forward + fit.members.backward >= kLately &&
           0.5 * std::abs(fit.drift) * span * span < static_cast<double>(fit.mean_wait);
  }

  /// All rounds. False: nothing determines the line.
  [[nodiscard]] bool settle(FloorFit& fit, bool drifts) const noexcept {
    PerDirection<Waits> waits;
    for (int round = 0; round < kRounds; ++round) {
      waits = {};
      if (!improve(fit, waits, drifts)) return false;
    }
    tell_apart(fit, waits);
    return true;
  }

  /// Expectation: adds each message by the probability that it is at the floor. Their squares.
  [[nodiscard]] double expect(FloorFit& fit, DriftSums& sums,
                              PerDirection<Waits>& waits) const noexcept {
    double squares = 0.0;
    // One later than this waited, whatever the shares, and costs no exponential.
    const double latest = fit.sigma() * std::sqrt(2.0 * kBeyondDoubt);
    for (const Direction direction : kDirections) {
      const RecordWindow& window = windows_[direction];
      double members = 0.0;
      for (std::size_t k = 0; k < window.size; ++k) {
        const RecordedMessage& m = window[k];
        const double time = window.time(m);
        const double nu = innovation(fit, direction, m, time);
        if (nu > latest) {
          waits[direction].messages += 1.0;
          waits[direction].ns += nu;
          continue;
        }
        double density = 0.0;
        const double credit = fit.noise[direction].at_floor(nu, density);
        // Relative to the line so far: small numbers, whose squares lose nothing.
        const double left = sign_of(direction) * nu;
        sums.add(sign_of(direction), time, left, credit);
        squares += credit * nu * nu;
        members += credit;
        waits[direction].messages += 1.0 - credit;
        waits[direction].ns += (1.0 - credit) * std::max(nu, 0.0);
      }
      fit.members[direction] = members;
      const double share = members / static_cast<double>(window.size);
      fit.noise[direction].share = std::clamp(share, 0.01, 0.99);
    }
    return squares;
  }

  /// One round of expectation and maximisation. False: nothing determines the line.
  [[nodiscard]] bool improve(FloorFit& fit, PerDirection<Waits>& waits,
                             bool drifts) const noexcept {
    DriftSums sums;
    const double squares = expect(fit, sums, waits);
    Estimate change;
    double drift = 0.0;
    const LineSums& line = sums.line;
    const bool enough =
        fit.members.forward >= 1.5 && fit.members.backward >= 1.5 && line.n >= kRepeated;
    if (!enough || !(drifts ? sums.solve(change, drift) : line.solve(change))) return false;
    const double explained =
        change.x * line.z + change.y * line.tz + change.d * line.sz + 0.5 * drift * sums.ttz;
    fit.drift += drift;
    change.x += fit.estimate.x;
    change.y += fit.estimate.y;
    change.d += fit.estimate.d;
    fit.estimate = change;
    const double variance =
        std::max(0.0, squares - explained) / std::max(1.0, line.n - (drifts ? 4.0 : 3.0));
    const double sigma = std::max(smallest_, std::sqrt(variance));
    const double waited = waits.forward.messages + waits.backward.messages;
    if (waited > 1.0) {
      const double mean = (waits.forward.ns + waits.backward.ns) / waited;
      fit.mean_wait = static_cast<float>(std::max(mean, 8.0 * smallest_));
    }
    for (const Direction direction : kDirections) {
      fit.noise[direction].sigma = sigma;
      fit.noise[direction].mean_wait = static_cast<double>(fit.mean_wait);
    }
    return true;
  }

  /// Two exponentials against one, ln likelihood ratio: sum of n_i ln(tau / tau_i).
  void tell_apart(FloorFit& fit, const PerDirection<Waits>& waits) const noexcept {
    const auto together = static_cast<double>(fit.mean_wait);
    PerDirection<double> own{together, together};
    double apart = 0.0;
    for (const Direction direction : kDirections) {
      const Waits& of = waits[direction];
      if (fit.clear(direction) || !(of.messages > 1.0)) continue;
      own[direction] = std::max(of.ns / of.messages, 8.0 * smallest_);
      apart += of.messages * quick_log(together / own[direction]);
    }
    if (!(apart > kCertain)) return;
    for (const Direction direction : kDirections) fit.noise[direction].mean_wait = own[direction];
  }

  /// Members, likelihoods and whether all that is asked of a floor holds.
  void judge(FloorFit& fit) const noexcept {
    const double sigma = fit.sigma();
    const auto wait = static_cast<double>(fit.mean_wait);
    const double chosen = quick_log(std::max(std::numbers::e, wait / sigma));
    PerDirection<double> speaks{};
    bool lasting = true;
    for (const Direction direction : kDirections) {
      const double gained = judge(fit, direction, lasting);
      speaks[direction] = gained - chosen;
    }
    const double shared = fit.drift != 0.0 ? 2.0 * chosen : chosen;  // rate, and its drift
    const bool ahead = fit.clear(Direction::kForward);
    const bool back = fit.clear(Direction::kBackward);
    if (ahead == back) {
      // Together they must convince for two, and each speak for half of that. Each tells its own
      // level, the one that says more what both share.
      const double sum = speaks.forward + speaks.backward - shared;
      const double more = std::max(speaks.forward, speaks.backward);
      const double less = std::min(std::min(speaks.forward, speaks.backward), more - shared);
      fit.evidence = ahead ? sum : std::min(0.5 * sum, 2.0 * less);
    } else {
      fit.evidence = ahead ? speaks.backward : speaks.forward;
    }
    const double longer = std::max(fit.noise.forward.mean_wait, fit.noise.backward.mean_wait);
    fit.found = lasting && std::min(fit.members.forward, fit.members.backward) >= kFew &&
                sigma < kSharp * wait && WaitDensity::holds(longer);
  }

  /// Nats by which the floor explains one direction better than waits without one.
  [[nodiscard]] double judge(FloorFit& fit, Direction direction, bool& lasting) const noexcept {
    const RecordWindow& window = windows_[direction];
    const double young = std::min(windows_.forward.time(windows_.forward[0]),
                                  windows_.backward.time(windows_.backward[0])) /
                         3.0;
    FloorNoise without{0.0, smallest_, 0.0};
    for (std::size_t k = 0; k < window.size; ++k) {
      without.mean_wait += above_touching_line(direction, window[k]);
    }
    without.mean_wait = std::max(without.mean_wait / static_cast<double>(window.size), smallest_);
    double members = 0.0, recent = 0.0, recent_all = 0.0, gained = 0.0;
    for (std::size_t k = 0; k < window.size; ++k) {
      const RecordedMessage& m = window[k];
      const double time = window.time(m);
      double with_floor = 0.0;
      double no_floor = 0.0;
      const double credit =
          fit.noise[direction].at_floor(innovation(fit, direction, m, time), with_floor);
      (void)without.at_floor(std::max(above_touching_line(direction, m), 1e-9), no_floor);
      const double log_density = quick_log(with_floor);
      gained += log_density - quick_log(no_floor);
      fit.log_likelihood += m.said == 0.0F ? 0.0 : log_density;
      fit.said += static_cast<double>(m.said);
      members += credit;
      if (time <= young) continue;
      recent += credit;
      recent_all += 1.0;
    }
    fit.members[direction] = members;
    // A path that changed leaves its old floor behind: in the newest third there are fewer at it.
    lasting =
        lasting && recent >= kSmallPart * recent_all * members / static_cast<double>(window.size);
    return gained;
  }

  [[nodiscard]] double above_touching_line(Direction direction,
                                           const RecordedMessage& m) const noexcept {
    const double time = windows_[direction].time(m);
    return height(direction, m, best_.rate, time) - best_.floor[direction];
  }

  const Windows& windows_;
  double smallest_;
  double total_;
  double base_;
  std::size_t tried_ = 0;
  Candidate best_{};
};

}  // namespace

double FloorNoise::at_floor(double nu, double& density) const noexcept {
  const double ratio = nu / sigma;
  const double exponent = std::max(-0.5 * ratio * ratio, kLeastExponent);
  const double normal = share * quick_exp(exponent) / (sigma * kRootTwoPi);
  double other = kHardlyEver / any_size(nu, sigma);
  if (nu > 0.0) {
    const double exponential = quick_exp(std::max(-nu / mean_wait, kLeastExponent)) / mean_wait;
    const double unknown = 1.0 / std::max(any_size(nu, sigma), kLogRange * kSmallPart * mean_wait);
    other = (1.0 - share) * ((1.0 - kUnlikely) * exponential + kUnlikely * unknown);
  }
  density = normal + other;
  return normal / density;
}

double FloorFit::offset_sigma_ns() const noexcept { return sigma() * std::sqrt(estimate.xx); }

bool FloorFit::clear(Direction direction) const noexcept {
  return noise[direction].share > kNearlyAll;
}

FloorFit fit_floor(const PerDirection<RecordWindow>& windows, double least_noise) noexcept {
  if (std::min(windows.forward.size, windows.backward.size) < kRepeated) return {};
  return Fit(windows, least_noise).run();
}

}  // namespace ftcs::estimation
