// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/line_sums.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/estimation/wait_density.h"

namespace ftcs::estimation {
namespace {

constexpr int kRounds = 8;
constexpr double kRootTwoPi = 2.5066282746310002;

/// What a fit reads of the record.
struct Gathered {
  Gathered(const PerDirection<RecordWindow>& of, double least_noise) noexcept
      : windows(of),
        smallest(std::max(least_noise, kLeastNoise)),
        base(of.forward[of.forward.size - 1].z) {
    for (const Direction direction : kDirections) {
      messages[direction].read(direction, of[direction], base);
    }
  }
  const PerDirection<RecordWindow>& windows;
  double smallest;  ///< ns, of noise
  double base;
  PerDirection<FloorMessages> messages;
};

/// Of one direction: messages that waited, and for how long in all.
struct Waits {
  double messages = 0.0;
  double ns = 0.0;
};

class Fit {
 public:
  Fit(const Gathered& all, const TouchingRate& best) noexcept
      : all_(all),
        messages_(all.messages),
        smallest_(all.smallest),
        best_(best),
        lines_(touching_lines(all.messages, best.rate)) {}

  [[nodiscard]] FloorFit run() noexcept {
    FloorFit fit;
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
    fit.estimate.x += all_.base;
    return fit;
  }

 private:
  void start(FloorFit& fit) const noexcept {
    const double sigma = std::max(smallest_, best_.width / 3.0);
    const double wait = std::max(lines_.mean, smallest_);
    fit.noise = {{0.5, sigma, wait}, {0.5, sigma, wait}};
    fit.mean_wait = static_cast<float>(wait);
    fit.estimate.x = 0.5 * (lines_.floor.forward - lines_.floor.backward);
    fit.estimate.d = 0.5 * (lines_.floor.forward + lines_.floor.backward) + 1.5 * sigma;
  }

  [[nodiscard]] static double innovation(const FloorFit& fit, const FloorMessages& of,
                                         std::size_t k) noexcept {
    return of.lifted[k] - of.sign * fit.offset_at(of.time(k)) - fit.estimate.d;
  }

  /// Messages wait, enough for four unknowns did not, and the waits are what is long.
  [[nodiscard]] bool may_drift(const FloorFit& fit) const noexcept {
    const bool clear = fit.clear(Direction::kForward) && fit.clear(Direction::kBackward);
    const double span = std::min(messages_.forward.time(0), messages_.backward.time(0));
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
      const FloorMessages& of = messages_[direction];
      double members = 0.0;
      for (std::size_t k = 0; k < of.size; ++k) {
        const double nu = innovation(fit, of, k);
        if (nu > latest) {
          waits[direction].messages += 1.0;
          waits[direction].ns += nu;
          continue;
        }
        double density = 0.0;
        const double credit = fit.noise[direction].at_floor(nu, density);
        // Relative to the line so far: small numbers, whose squares lose nothing.
        sums.add(of.sign, of.time(k), of.sign * nu, credit);
        squares += credit * nu * nu;
        members += credit;
        waits[direction].messages += 1.0 - credit;
        waits[direction].ns += (1.0 - credit) * std::max(nu, 0.0);
      }
      fit.members[direction] = members;
      const double share = members / static_cast<double>(of.size);
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
    const FloorMessages& of = messages_[direction];
    const RecordWindow& window = all_.windows[direction];
    const double young = std::min(messages_.forward.time(0), messages_.backward.time(0)) / 3.0;
    const auto size = static_cast<double>(of.size);
    FloorNoise without{0.0, smallest_, 0.0};
    for (std::size_t k = 0; k < of.size; ++k) without.mean_wait += above_touching_line(direction, k);
    without.mean_wait = std::max(without.mean_wait / size, smallest_);
    double members = 0.0, recent = 0.0, recent_all = 0.0, gained = 0.0;
    for (std::size_t k = 0; k < of.size; ++k) {
      double with_floor = 0.0;
      double no_floor = 0.0;
      const double credit =
          fit.noise[direction].at_floor(innovation(fit, of, k), with_floor);
      (void)without.at_floor(std::max(above_touching_line(direction, k), 1e-9), no_floor);
      const double log_density = quick_log(with_floor);
      gained += log_density - quick_log(no_floor);
      fit.log_likelihood += window[k].said == 0.0F ? 0.0 : log_density;
      fit.said += static_cast<double>(window[k].said);
      members += credit;
      if (of.time(k) <= young) continue;
      recent += credit;
      recent_all += 1.0;
    }
    fit.members[direction] = members;
    // A path that changed leaves its old floor behind: in the newest third there are fewer at it.
    lasting = lasting && recent >= kSmallPart * recent_all * members / size;
    return gained;
  }

  [[nodiscard]] double above_touching_line(Direction direction, std::size_t k) const noexcept {
    return messages_[direction].height(k, best_.rate) - lines_.floor[direction];
  }

  const Gathered& all_;
  const PerDirection<FloorMessages>& messages_;
  double smallest_;
  TouchingRate best_;
  TouchingLines lines_;
};

bool too_few(const PerDirection<RecordWindow>& windows) noexcept {
  return std::min(windows.forward.size, windows.backward.size) < kRepeated;
}

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

TouchingRate touch_floor(const PerDirection<RecordWindow>& windows, double least_noise) noexcept {
  if (too_few(windows)) return {};
  const Gathered all(windows, least_noise);
  return best_touching_rate(all.messages, all.smallest);
}

FloorFit fit_floor(const PerDirection<RecordWindow>& windows, const TouchingRate& best,
                   double least_noise) noexcept {
  if (!(best.width > 0.0) || too_few(windows)) return {};
  const Gathered all(windows, least_noise);
  return Fit(all, best).run();
}

FloorFit fit_floor(const PerDirection<RecordWindow>& windows, double least_noise) noexcept {
  if (too_few(windows)) return {};
  const Gathered all(windows, least_noise);
  const TouchingRate best = best_touching_rate(all.messages, all.smallest);
  if (!(best.width > 0.0)) return {};
  return Fit(all, best).run();
}

}  // namespace ftcs::estimation
