// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/clock_state.h"
#include "ftcs/estimation/delay_shape.h"
#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/noise_model.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/time/per_direction.h"

namespace ftcs::estimation {

/// One timestamp pair as the filters see it: z = free running - reference -
/// base, in ns.
struct Observation {
  double sign = 1.0;     ///< +1 forward, -1 backward
  double elapsed = 0.0;  ///< cycles since the previous event; negative if it happened earlier
  double z = 0.0;        ///< = x + sign (d + n): x offset at the event, d path delay,
                         ///< n delay noise
};

[[nodiscard]] inline Direction direction_of(const Observation& seen) noexcept {
  return seen.sign > 0.0 ? Direction::kForward : Direction::kBackward;
}

/// Outlier hypothesis of one direction: probability of a late and of an early
/// outlier.
struct OutlierPrior {
  double late = 0.0;
  double early = 0.0;
};

/// Kalman filters of the same three states under different noise models, all
/// fed with the same observations; steering never enters them. With h = (1, 0,
/// sign):
///
///     x += y dt,   P = F P F' + Q(a, b, dt)
///     nu = sign (z - h state),   S = s^2 (h P h' + v)           nu > 0: the packet is late
///     state += P h' sign slope(nu) s^2,   P -= P h' h P curvature(nu) s^2
///
/// slope and curvature are those of the delay noise (delay_shape.h), damped by
/// `credit`, the probability that the packet is no outlier. For normal noise
/// they are nu / S and 1 / S, and each filter is Kalman's; for any other
/// density Masreliez's (IEEE Trans. AC-20, 1975).
///
/// The cost of a message is kSize times that of one filter of three states; on
/// processors with vectors two or four filters go in step (lanes.h), each with
/// the bits that it would have alone.
template <class Grid>
class ModelBank {
 public:
  static constexpr std::size_t kSize = Grid::kSize;
  using Row = std::array<double, kSize>;
  using V = typename LanesOf<kSize>::Type;
  static constexpr std::size_t kStep = kLanes<V>;

  /// What one observation says about every model.
  struct Innovations {
    Row centred;      ///< nu less the mean delay noise, ns
    Row variance;     ///< its predicted variance, ns^2
    Row distance;     ///< centred^2 / variance
    Row predicted;    ///< h P h', units of s^2
    Row log_density;  ///< outliers included
    Row log_variance;
    Row credit;  ///< probability that the packet is no outlier
    Row slope;
    Row curvature;
  };

  /// Every model begins with this.
  void start(const Estimate& estimate) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) set(i, estimate);
  }

  /// False: nothing is left of what the model `trusted` knew.
  /// `added`: process noise of the oscillator beyond that of the models.
  [[nodiscard]] bool predict(double elapsed, std::size_t trusted,
                             const NoiseModel& added = {}) noexcept {
    V wildest{};
    for (std::size_t k = 0; k < kPacks; ++k) {
      ClockState<V> state = pack(k);
      state.elapse(elapsed, noise(k, added));
      set_pack(k, state);
      wildest = larger(wildest, larger(larger(state.xx, state.yy), state.dd));
    }
    if (largest(wildest) <= kLargestVariance) return true;
    const Estimate known = estimate(trusted);
    const bool lost = !(std::max(known.xx, known.yy) <= kLargestVariance);
    contain();
    return !lost;
  }

  /// Judges one observation; without `gate` nothing is taken for an outlier.
  [[nodiscard]] Innovations judge(const Observation& seen, const DelayShape& shape, double scale,
                                  const OutlierPrior& outliers, bool gate) const noexcept {
    const double s2 = scale * scale;
    const double tail = scale * shape.tail;
    Innovations out;
    V furthest{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const ClockState<V> state = pack(i / kStep);
      const V predicted = state.variance_seen(seen.sign);
      const V variance = s2 * (predicted + shape.variance) + tail * tail;
      const V centred = state.innovation(seen.sign, seen.z) - tail;
      const V curvature = 1.0 / variance;
      const V slope = centred * curvature;
      const V distance = centred * slope;
      const V log_variance = quick_log(variance);
      store(&out.centred[i], centred);
      store(&out.variance[i], variance);
      store(&out.distance[i], distance);
      store(&out.predicted[i], predicted);
      store(&out.log_variance[i], log_variance);
      store(&out.log_density[i], -0.5 * (distance + log_variance + kLn2Pi));
      store(&out.credit[i], V{} + 1.0);
      store(&out.slope[i], slope);
      store(&out.curvature[i], curvature);
      furthest = larger(furthest, distance);
    }
    if (tail > 0.0) judge_late(s2 * shape.variance, s2, tail, out);
    if (gate && largest(furthest) > kThreeSigma) doubt(outliers, out);
    return out;
  }

  /// Takes in what judge() said of the same observation.
  void correct(const Observation& seen, double scale, const Innovations& innovations) noexcept {
    const double s2 = scale * scale;
    for (std::size_t i = 0; i < kSize; i += kStep) {
      ClockState<V> state = pack(i / kStep);
      state.absorb(seen.sign, s2, load<V>(&innovations.slope[i]),
                   load<V>(&innovations.curvature[i]));
      set_pack(i / kStep, state);
    }
  }

  /// What model i believes; i < kSize.
  [[nodiscard]] Estimate estimate(std::size_t i) const noexcept {
    return pack(i / kStep).lane(i % kStep);
  }
  void set(std::size_t i, const Estimate& e) noexcept {
    ClockState<V> state = pack(i / kStep);
    state.set_lane(i % kStep, e);
    set_pack(i / kStep, state);
  }
  /// Every state finite and every covariance positive.
  [[nodiscard]] bool healthy() const noexcept {
    V sum{};
    V smallest = V{} + 1.0;
    for (std::size_t k = 0; k < kPacks; ++k) {
      const auto health = pack(k).health(kDelayWalk);
      sum += health.finite;
      smallest = lesser(smallest, health.positive);
    }
    return total(sum) == 0.0 && least(smallest) > 0.0;
  }
  /// Models that rounding or absurd input has broken take the state of `donor`,
  /// or of the first that is whole. False: there is none.
  [[nodiscard]] bool heal(std::size_t donor) noexcept {
    const auto whole = [this](std::size_t i) {
      const auto health = estimate(i).health(kDelayWalk);
      return health.finite == 0.0 && health.positive > 0.0;
    };
    for (std::size_t i = 0; i < kSize && !whole(donor); ++i) donor = i;
    if (!whole(donor)) return false;
    for (std::size_t i = 0; i < kSize; ++i) {
      if (!whole(i)) set(i, estimate(donor));
    }
    return true;
  }
  /// The same change to every model.
  template <class Change>
  void for_each(Change change) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) {
      Estimate e = estimate(i);
      change(e);
      set(i, e);
    }
  }

  /// Mean of all models under the given weights (sum one), and the mean square about it under those
  /// of `doubt` (sum one; Evidence::lean()): covariances and the spread between the models (ns^2 of
  /// it brought to units of s^2).
  [[nodiscard]] Estimate mixture(const Row& weight, const Row& doubt, double scale) const noexcept {
    V x{}, y{}, d{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V w = load<V>(&weight[i]);
      if (total(w) == 0.0) continue;  // most of them
      const ClockState<V> state = pack(i / kStep);
      x += w * state.x;
      y += w * state.y;
      d += w * state.d;
    }
    Estimate mean;
    mean.x = total(x);
    mean.y = total(y);
    mean.d = total(d);
    const double per_s2 = 1.0 / (scale * scale);
    V xx{}, xy{}, xd{}, yy{}, yd{}, dd{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V w = load<V>(&doubt[i]);
      if (total(w) == 0.0) continue;
      const ClockState<V> state = pack(i / kStep);
      const V dx = state.x - mean.x;
      const V dy = state.y - mean.y;
      const V dz = state.d - mean.d;
      xx += w * (state.xx + dx * dx * per_s2);
      xy += w * (state.xy + dx * dy * per_s2);
      xd += w * (state.xd + dx * dz * per_s2);
      yy += w * (state.yy + dy * dy * per_s2);
      yd += w * (state.yd + dy * dz * per_s2);
      dd += w * (state.dd + dz * dz * per_s2);
    }
    mean.xx = total(xx);
    mean.xy = total(xy);
    mean.xd = total(xd);
    mean.yy = total(yy);
    mean.yd = total(yd);
    mean.dd = total(dd);
    return mean;
  }

  /// Mean of the models' noise under the given weights (the delay's walk left
  /// out).
  [[nodiscard]] NoiseModel mean_noise(const Row& weight) const noexcept {
    V white{}, walk{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      white += load<V>(&weight[i]) * load<V>(&kWhiteFm[i]);
      walk += load<V>(&weight[i]) * load<V>(&kRandomWalkFm[i]);
    }
    return {total(white), total(walk), 0.0};
  }

  /// The models' parameters, one kind in a row.
  static constexpr Row kWhiteFm = column(Grid::kModels, &NoiseModel::white_fm);
  static constexpr Row kRandomWalkFm = column(Grid::kModels, &NoiseModel::random_walk_fm);

  /// Beyond it a model knows nothing, and its variance after the next message
  /// would be rounding.
  static constexpr double kLargestVariance = 1e11;

 private:
  static constexpr std::size_t kPacks = kSize / kStep;

  static constexpr std::size_t kPackNumbers = 9 * kStep;
  static_assert(sizeof(ClockState<V>) == kPackNumbers * sizeof(double));

  [[nodiscard]] ClockState<V> pack(std::size_t k) const noexcept {
    return load<ClockState<V>>(&numbers_[k * kPackNumbers]);
  }
  void set_pack(std::size_t k, const ClockState<V>& state) noexcept {
    store(&numbers_[k * kPackNumbers], state);
  }
  /// Of the models in one pack of lanes.
  [[nodiscard]] static ProcessNoise<V> noise(std::size_t pack, const NoiseModel& added) noexcept {
    const std::size_t i = pack * kStep;
    return {load<V>(&kWhiteFm[i]) + added.white_fm,
            load<V>(&kRandomWalkFm[i]) + added.random_walk_fm, V{} + kDelayWalk};
  }
  /// A covariance that is too large shrinks as a whole, so that it stays a
  /// covariance.
  void contain() noexcept {
    for_each([](Estimate& e) {
      const double largest = std::max(std::max(e.xx, e.yy), e.dd);
      if (largest > kLargestVariance) e.rescale_covariance(kLargestVariance / largest);
    });
  }

  /// Even the calmest path changes in the end; keeps the covariance of d from
  /// collapsing.
  static constexpr double kDelayWalk = 1e-9;

  /// Queueing noise: slope, curvature and density of the late shape.
  static void judge_late(double noise, double s2, double tail, Innovations& out) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) {
      const double spread = s2 * out.predicted[i] + noise;
      const Score score = late_score(out.centred[i] + tail, spread, tail);
      out.slope[i] = score.slope;
      out.curvature[i] = score.curvature;
      out.log_density[i] = score.log_density;
    }
  }

  /// The outlier hypothesis: an error of any size. Up to three sigma nothing is
  /// taken for one, and its density is not worth computing.
  static void doubt(const OutlierPrior& outliers, Innovations& out) noexcept {
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V distance = load<V>(&out.distance[i]);
      if (largest(distance) <= kThreeSigma) continue;
      const V centred = load<V>(&out.centred[i]);
      const V late = V{} + outliers.late;
      const V early = V{} + outliers.early;
      const V probability = centred > 0.0 ? late : early;
      const V outlier = probability / any_size<V>(centred, root(load<V>(&out.variance[i])));
      const V log_density = load<V>(&out.log_density[i]);
      const V density = quick_exp(larger<V>(log_density, V{} + kLeastExponent));
      const V mixed = density + outlier;
      const V near = V{} + kThreeSigma;
      const V one = V{} + 1.0;
      const V credit = distance > near ? density / mixed : one;
      store(&out.credit[i], credit);
      store(&out.log_density[i], distance > near ? quick_log(mixed) : log_density);
      store(&out.slope[i], load<V>(&out.slope[i]) * credit);
      store(&out.curvature[i], load<V>(&out.curvature[i]) * credit);
    }
  }

  /// As plain numbers: a vector would ask for an alignment that the storage of a servo in C has
  /// not.
  std::array<double, 9 * kSize> numbers_{};
};

}  // namespace ftcs::estimation
