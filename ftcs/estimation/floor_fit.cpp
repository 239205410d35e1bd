// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/line_sums.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/estimation/touching_lines.h"
#include "ftcs/estimation/wait_density.h"

namespace ftcs::estimation {
namespace {

constexpr int kRounds = 8;

/// FloorNoise for many messages: what does not depend on them is computed once.
class FloorDensity {
 public:
  explicit FloorDensity(const FloorNoise& noise) noexcept
      : precision_(1.0 / noise.sigma),
        height_(noise.share * precision_ / kRootTwoPi),
        decay_(-1.0 / noise.mean_wait),
        waits_(-(1.0 - noise.share) * (1.0 - kUnlikely) * decay_),
        unknown_((1.0 - noise.share) * kUnlikely),
        least_size_(kLogRange * kSmallPart * noise.mean_wait),
        sigma_(noise.sigma) {}

  /// V: one message, or a Pair.
  template <class V>
  [[nodiscard]] V at_floor(const V& nu, V& density) const noexcept {
    const V least = V{} + kLeastExponent;
    const V ratio = nu * precision_;
    const V normal = height_ * quick_exp(larger<V>(-0.5 * ratio * ratio, least));
    // (Of early ones nothing waits: any number may come out, and none is used.)
    const V waits = waits_ * quick_exp(larger<V>(nu * decay_, least));
    const V size = any_size<V>(nu, V{} + sigma_);
    const V even = (nu > V{} ? V{} + unknown_ : V{} + kHardlyEver) /
                   (nu > V{} ? larger<V>(size, V{} + least_size_) : size);
    density = normal + (nu > V{} ? waits + even : even);
    return normal / density;
  }

 private:
  static constexpr double kRootTwoPi = 2.5066282746310002;
  double precision_;   ///< 1/ns, one over sigma
  double height_;      ///< 1/ns, of the normal part
  double decay_;       ///< minus one over the mean wait, 1/ns
  double waits_;       ///< 1/ns, their density at the floor
  double unknown_;     ///< probability of a wait of any size
  double least_size_;  ///< ns
  double sigma_;       ///< ns
};

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
  double base;      ///< ns, taken off all stamps: small numbers lose fewer digits
  PerDirection<FloorMessages> messages;
};

/// Of one direction: messages that waited, and for how long in all.
struct Waits {
  double messages = 0.0;
  double ns = 0.0;
};

/// Sums over messages of one direction at times t, cycles, of innovation nu, ns, and weight.
template <class V>
struct Moments {
  V n{}, t{}, tt{}, ttt{}, tttt{}, nu{}, tnu{}, ttnu{};

  void add(const V& time, const V& innovation, const V& weight, bool drifts) noexcept {
    const V first = weight * time;
    const V second = first * time;
    n += weight;
    t += first;
    tt += second;
    nu += weight * innovation;
    tnu += first * innovation;
    if (!drifts) return;
    ttt += second * time;
    tttt += second * time * time;
    ttnu += second * innovation;
  }

  /// As messages of the line z = sign nu.
  void add_to(DriftSums& sums, double sign) const noexcept {
    sums.line.n += total(n);
    sums.line.t += total(t);
    sums.line.s += sign * total(n);
    sums.line.tt += total(tt);
    sums.line.ts += sign * total(t);
    sums.line.z += sign * total(nu);
    sums.line.tz += sign * total(tnu);
    sums.line.sz += total(nu);
    sums.ttt += total(ttt);
    sums.tts += sign * total(tt);
    sums.tttt += total(tttt);
    sums.ttz += sign * total(ttnu);
  }
};

class Fit {
 public:
  Fit(const Gathered& all, const TouchingLines& lines) noexcept
      : all_(all),
        messages_(all.messages),
        smallest_(all.smallest),
        lines_(lines),
        without_floor_{without_floor(Direction::kForward), without_floor(Direction::kBackward)} {}

  [[nodiscard]] FloorFit run() noexcept {
    FloorFit fit;
    fit.estimate.y = lines_.rate;
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
    const double sigma = std::max(smallest_, lines_.width / 3.0);
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

  /// Messages of one direction that may be at the floor, an even number of places.
  struct Near {
    std::array<double, FloorMessages::kCapacity> nu;    ///< innovation, ns
    std::array<double, FloorMessages::kCapacity> time;  ///< cycles, negative
    std::size_t count = 0;

    /// `latest`, ns: one later than this waited, whatever the shares, and costs no exponential.
    Near(const FloorFit& fit, const FloorMessages& of, double latest, Waits& waits) noexcept {
      for (std::size_t k = 0; k < of.size; ++k) {  // no branch that half of them take
        const double ns = innovation(fit, of, k);
        const bool waited = ns > latest;
        waits.messages += waited ? 1.0 : 0.0;
        waits.ns += waited ? ns : 0.0;
        nu[count] = ns;
        time[count] = of.time(k);
        count += waited ? 0U : 1U;
      }
      if (count % 2 == 0) return;
      nu[count] = nu[count - 1];
      time[count] = time[count - 1];
    }
  };

  /// Expectation: adds each message by the probability that it is at the floor, two at a time.
  /// Innovations are relative to the line so far: small numbers, whose squares lose nothing.
  /// Returns their sum of squares. (Kept apart: its tables would stand beside those of the fit.)
  [[gnu::noinline]] [[nodiscard]] double expect(FloorFit& fit, DriftSums& sums,
                                                PerDirection<Waits>& waits,
                                                bool drifts) const noexcept {
    Pair squares{};
    const double latest = fit.sigma() * std::sqrt(2.0 * kBeyondDoubt);
    for (const Direction direction : kDirections) {
      const FloorMessages& of = messages_[direction];
      const Near near(fit, of, latest, waits[direction]);
      const FloorDensity noise(fit.noise[direction]);
      Moments<Pair> all;
      Pair waited{};
      Pair late{};
      for (std::size_t i = 0; i < near.count; i += 2) {
        const Pair there{1.0, i + 1 < near.count ? 1.0 : 0.0};
        const Pair nu = load<Pair>(&near.nu[i]);
        Pair density{};
        const Pair credit = there * noise.at_floor<Pair>(nu, density);
        all.add(load<Pair>(&near.time[i]), nu, credit, drifts);
        squares += credit * nu * nu;
        waited += there - credit;
        late += (there - credit) * larger<Pair>(nu, Pair{});
      }
      waits[direction].messages += total(waited);
      waits[direction].ns += total(late);
      all.add_to(sums, of.sign);
      fit.members[direction] = total(all.n);
      const double share = fit.members[direction] / static_cast<double>(of.size);
      fit.noise[direction].share = std::clamp(share, 0.01, 0.99);
    }
    return total(squares);
  }

  /// One round of expectation and maximisation. False: nothing determines the line.
  [[nodiscard]] bool improve(FloorFit& fit, PerDirection<Waits>& waits,
                             bool drifts) const noexcept {
    DriftSums sums;
    const double squares = expect(fit, sums, waits, drifts);
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
    const FloorDensity density(fit.noise[direction]);
    double members = 0.0, recent = 0.0, recent_all = 0.0, explained = 0.0;
    const auto add = [&](std::size_t k, double credit, double floor) {
      explained += floor;
      fit.log_likelihood += window[k].said == 0.0F ? 0.0 : floor;
      fit.said += static_cast<double>(window[k].said);
      members += credit;
      if (of.time(k) <= young) return;
      recent += credit;
      recent_all += 1.0;
    };
    for (std::size_t k = 0; k < of.size; k += 2) {
      const std::size_t next = std::min(k + 1, of.size - 1);
      const Pair nu{innovation(fit, of, k), innovation(fit, of, next)};
      Pair floor{};
      const Pair credit = density.at_floor<Pair>(nu, floor);
      floor = quick_log(floor);
      add(k, credit[0], floor[0]);
      if (next > k) add(next, credit[1], floor[1]);
    }
    fit.members[direction] = members;
    // A path that changed leaves its old floor behind: in the newest third there are fewer at it.
    lasting = lasting && recent >= kSmallPart * recent_all * members / size;
    return explained - without_floor_[direction];
  }

  /// ln likelihood of the messages of one direction, all of which waited.
  [[nodiscard]] double without_floor(Direction direction) const noexcept {
    const FloorMessages& of = messages_[direction];
    double mean = 0.0;
    for (std::size_t k = 0; k < of.size; ++k) mean += above_touching_line(direction, k);
    mean = std::max(mean / static_cast<double>(of.size), smallest_);
    const FloorDensity density({0.0, smallest_, mean});
    double explained = 0.0;
    for (std::size_t k = 0; k < of.size; k += 2) {
      const std::size_t next = std::min(k + 1, of.size - 1);
      const Pair above{above_touching_line(direction, k), above_touching_line(direction, next)};
      Pair none{};
      (void)density.at_floor<Pair>(larger<Pair>(above, Pair{} + 1e-9), none);
      none = quick_log(none);
      explained += next > k ? none[0] + none[1] : none[0];
    }
    return explained;
  }

  [[nodiscard]] double above_touching_line(Direction direction, std::size_t k) const noexcept {
    return messages_[direction].height(k, lines_.rate) - lines_.floor[direction];
  }

  const Gathered& all_;
  const PerDirection<FloorMessages>& messages_;
  double smallest_;
  const TouchingLines& lines_;
  PerDirection<double> without_floor_;
};

}  // namespace

double FloorNoise::at_floor(double nu, double& density) const noexcept {
  return FloorDensity(*this).at_floor(nu, density);
}

double FloorFit::offset_sigma_ns() const noexcept { return sigma() * std::sqrt(estimate.xx); }

bool FloorFit::clear(Direction direction) const noexcept {
  return noise[direction].share > kNearlyAll;
}

FloorFit fit_floor(const PerDirection<RecordWindow>& windows, double least_noise) noexcept {
  if (std::min(windows.forward.size, windows.backward.size) < kRepeated) return {};
  const Gathered all(windows, least_noise);
  const TouchingLines lines = best_touching_lines(all.messages, all.smallest);
  if (!(lines.width > 0.0)) return {};
  return Fit(all, lines).run();
}

}  // namespace ftcs::estimation
