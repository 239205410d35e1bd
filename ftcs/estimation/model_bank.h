// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "ftcs/estimation/delay_shape.h"
#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/noise_model.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/time/per_direction.h"

namespace ftcs::estimation {

/// One timestamp pair as the filters see it: z = free running - reference - base, in ns.
struct Observation {
  double sign = 1.0;     ///< +1 forward, -1 backward
  double elapsed = 0.0;  ///< cycles since the previous event; negative if it happened earlier
  double z = 0.0;        ///< = x + sign (d + n): x offset at the event, d path delay, n delay noise
};

[[nodiscard]] inline Direction direction_of(const Observation& seen) noexcept {
  return seen.sign > 0.0 ? Direction::kForward : Direction::kBackward;
}

/// Mean and covariance of one filter: offset x (ns), its drift y (ns per cycle), path delay d (ns);
/// covariances in units of s^2.
struct Estimate {
  double x = 0.0, y = 0.0, d = 0.0;
  double xx = 0.0, xy = 0.0, xd = 0.0, yy = 0.0, yd = 0.0, dd = 0.0;
};

/// The unit of time becomes `factor` times as long.
inline void rescale_time(Estimate& e, double factor) noexcept {
  e.y *= factor;
  e.xy *= factor;
  e.yd *= factor;
  e.yy *= factor * factor;
}

/// Outlier hypothesis of one direction: probability of a late and of an early outlier.
struct OutlierPrior {
  double late = 0.0;
  double early = 0.0;
};

/// Kalman filters of the same three states under different noise models, all fed with the same
/// observations; steering never enters them. With h = (1, 0, sign):
///
///     x += y dt;  P = F P F' + Q(a, b, dt)
///     nu = sign (z - h state),  S = s^2 (h P h' + v)       nu > 0: the packet is late
///     state += P h' sign slope(nu) s^2;  P -= P h' h P curvature(nu) s^2
///
/// slope and curvature are those of the delay noise (delay_shape.h), damped by `credit`, the
/// probability that the packet is no outlier.
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

  void start(const Estimate& estimate) noexcept {
    x_.fill(estimate.x);
    y_.fill(estimate.y);
    d_.fill(estimate.d);
    xx_.fill(estimate.xx);
    xy_.fill(estimate.xy);
    xd_.fill(estimate.xd);
    yy_.fill(estimate.yy);
    yd_.fill(estimate.yd);
    dd_.fill(estimate.dd);
  }

  /// False: nothing is left of what the model `trusted` knew.
  [[nodiscard]] bool predict(double elapsed, std::size_t trusted) noexcept {
    const double t = elapsed;
    const double span = std::abs(elapsed);
    const double cube = span * span * span / 3.0;
    V wildest{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V white = load<V>(&kWhiteFm[i]);
      const V walk = load<V>(&kRandomWalkFm[i]);
      const V y = load<V>(&y_[i]);
      const V xy = load<V>(&xy_[i]);
      const V yy = load<V>(&yy_[i]);
      store(&x_[i], load<V>(&x_[i]) + y * t);
      const V xx = load<V>(&xx_[i]) + 2.0 * t * xy + t * t * yy + white * span + walk * cube;
      store(&xx_[i], xx);
      store(&xy_[i], xy + t * yy + walk * (t * span / 2.0));
      store(&xd_[i], load<V>(&xd_[i]) + t * load<V>(&yd_[i]));
      const V grown = yy + walk * span;
      store(&yy_[i], grown);
      const V dd = load<V>(&dd_[i]) + load<V>(&kDelayWalks[i]) * span;
      store(&dd_[i], dd);
      wildest = larger(wildest, larger(larger(xx, grown), dd));
    }
    if (largest(wildest) <= kLargestVariance) return true;
    const bool lost = !(std::max(xx_[trusted], yy_[trusted]) <= kLargestVariance);
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
      const V predicted = load<V>(&xx_[i]) + 2.0 * seen.sign * load<V>(&xd_[i]) + load<V>(&dd_[i]);
      const V variance = s2 * (predicted + shape.variance) + tail * tail;
      const V centred = seen.sign * (seen.z - load<V>(&x_[i])) - load<V>(&d_[i]) - tail;
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
    if (gate && largest(furthest) > kSuspicious) doubt(outliers, out);
    return out;
  }

  void correct(const Observation& seen, double scale, const Innovations& innovations) noexcept {
    const double s2 = scale * scale;
    const double sign = seen.sign;
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V xd = load<V>(&xd_[i]);
      const V yd = load<V>(&yd_[i]);
      const V dd = load<V>(&dd_[i]);
      const V xx = load<V>(&xx_[i]);
      const V xy = load<V>(&xy_[i]);
      const V hx = xx + sign * xd;
      const V hy = xy + sign * yd;
      const V hd = xd + sign * dd;
      const V move = load<V>(&innovations.slope[i]) * (sign * s2);
      const V shrink = load<V>(&innovations.curvature[i]) * s2;
      const V shrink_x = hx * shrink;
      const V shrink_y = hy * shrink;
      store(&x_[i], load<V>(&x_[i]) + hx * move);
      store(&y_[i], load<V>(&y_[i]) + hy * move);
      store(&d_[i], load<V>(&d_[i]) + hd * move);
      store(&xx_[i], xx - hx * shrink_x);
      store(&xy_[i], xy - hy * shrink_x);
      store(&xd_[i], xd - hd * shrink_x);
      store(&yy_[i], load<V>(&yy_[i]) - hy * shrink_y);
      store(&yd_[i], yd - hd * shrink_y);
      store(&dd_[i], dd - hd * hd * shrink);
    }
  }

  [[nodiscard]] Estimate estimate(std::size_t i) const noexcept {
    return {x_[i], y_[i], d_[i], xx_[i], xy_[i], xd_[i], yy_[i], yd_[i], dd_[i]};
  }
  void set(std::size_t i, const Estimate& e) noexcept {
    x_[i] = e.x;
    y_[i] = e.y;
    d_[i] = e.d;
    xx_[i] = e.xx;
    xy_[i] = e.xy;
    xd_[i] = e.xd;
    yy_[i] = e.yy;
    yd_[i] = e.yd;
    dd_[i] = e.dd;
  }
  /// Every state finite and every covariance positive.
  [[nodiscard]] bool healthy() const noexcept {
    V sum{};
    V smallest = V{} + 1.0;
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const auto health = health_of<V>(i);
      sum += health.finite;
      smallest = lesser(smallest, health.positive);
    }
    return total(sum) == 0.0 && least(smallest) > 0.0;
  }
  /// Models that rounding or absurd input has broken take the state of `donor`, or of the first
  /// that is whole. False: there is none.
  [[nodiscard]] bool heal(std::size_t donor) noexcept {
    const auto whole = [this](std::size_t i) {
      const auto health = health_of<double>(i);
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

  /// Mean of all models under the given weights (sum one), and the covariance of that mixture
  /// (between-model spread included; ns^2 of it brought to units of s^2).
  [[nodiscard]] Estimate mixture(const Row& weight, double scale) const noexcept {
    V x{}, y{}, d{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V w = load<V>(&weight[i]);
      if (total(w) == 0.0) continue;  // most of them
      x += w * load<V>(&x_[i]);
      y += w * load<V>(&y_[i]);
      d += w * load<V>(&d_[i]);
    }
    Estimate mean;
    mean.x = total(x);
    mean.y = total(y);
    mean.d = total(d);
    const double per_s2 = 1.0 / (scale * scale);
    V xx{}, xy{}, xd{}, yy{}, yd{}, dd{};
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V w = load<V>(&weight[i]);
      if (total(w) == 0.0) continue;
      const V dx = load<V>(&x_[i]) - mean.x;
      const V dy = load<V>(&y_[i]) - mean.y;
      const V dz = load<V>(&d_[i]) - mean.d;
      xx += w * (load<V>(&xx_[i]) + dx * dx * per_s2);
      xy += w * (load<V>(&xy_[i]) + dx * dy * per_s2);
      xd += w * (load<V>(&xd_[i]) + dx * dz * per_s2);
      yy += w * (load<V>(&yy_[i]) + dy * dy * per_s2);
      yd += w * (load<V>(&yd_[i]) + dy * dz * per_s2);
      dd += w * (load<V>(&dd_[i]) + dz * dz * per_s2);
    }
    mean.xx = total(xx);
    mean.xy = total(xy);
    mean.xd = total(xd);
    mean.yy = total(yy);
    mean.yd = total(yd);
    mean.dd = total(dd);
    return mean;
  }

  /// Mean of the models' noise under the given weights (the delay's walk left out).
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

  /// Beyond it a model knows nothing, and its variance after the next message would be rounding.
  static constexpr double kLargestVariance = 1e11;

 private:
  /// `finite` is zero or not a number; `positive` is the least of what has to be above zero.
  template <class Lane>
  struct Health {
    Lane finite, positive;
  };
  template <class Lane>
  [[nodiscard]] Health<Lane> health_of(std::size_t i) const noexcept {
    const auto at = [i](const Row& row) { return load<Lane>(&row[i]); };
    const Lane xx = at(xx_);
    const Lane xy = at(xy_);
    const Lane xd = at(xd_);
    const Lane yy = at(yy_);
    const Lane dd = at(dd_);
    // Not finite times zero is not a number, which no comparison survives.
    const Lane finite = 0.0 * (at(x_) + at(y_) + at(d_) + xx + yy + dd + xy + xd + at(yd_));
    const Lane pinned = dd + kDelayWalk;
    const Lane minors = lesser<Lane>(xx * yy - xy * xy, xx * pinned - xd * xd);
    return {finite, lesser(lesser(xx, yy), lesser(pinned, minors))};
  }
  /// A covariance that is too large shrinks as a whole, so that it stays a covariance.
  void contain() noexcept {
    for (std::size_t i = 0; i < kSize; ++i) {
      const double largest = std::max(std::max(xx_[i], yy_[i]), dd_[i]);
      if (largest <= kLargestVariance) continue;
      const double share = kLargestVariance / largest;
      xx_[i] *= share;
      xy_[i] *= share;
      xd_[i] *= share;
      yy_[i] *= share;
      yd_[i] *= share;
      dd_[i] *= share;
    }
  }

  /// Even the calmest path changes in the end; keeps the covariance of d from collapsing.
  static constexpr double kDelayWalk = 1e-9;
  /// Two sigma: below it the outlier hypothesis cannot win, so its density is not worth computing.
  static constexpr double kSuspicious = 4.0;

  static constexpr double kLeastLogDensity = -700.0;
  static constexpr double kLn2Pi = 1.8378770664093453;

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

  /// The outlier hypothesis: density probability / (10 |centred|), broad and scale-free.
  static void doubt(const OutlierPrior& outliers, Innovations& out) noexcept {
    for (std::size_t i = 0; i < kSize; i += kStep) {
      const V distance = load<V>(&out.distance[i]);
      if (largest(distance) <= kSuspicious) continue;
      const V centred = load<V>(&out.centred[i]);
      const V late = V{} + outliers.late;
      const V early = V{} + outliers.early;
      const V probability = centred > 0.0 ? late : early;
      const V size = larger<V>(magnitude(centred), 3.0 * root(load<V>(&out.variance[i])));
      const V outlier = probability / (10.0 * size);
      const V log_density = load<V>(&out.log_density[i]);
      const V density = quick_exp(larger<V>(log_density, V{} + kLeastLogDensity));
      const V mixed = density + outlier;
      const V near = V{} + kSuspicious;
      const V one = V{} + 1.0;
      const V credit = distance > near ? density / mixed : one;
      store(&out.credit[i], credit);
      store(&out.log_density[i], distance > near ? quick_log(mixed) : log_density);
      store(&out.slope[i], load<V>(&out.slope[i]) * credit);
      store(&out.curvature[i], load<V>(&out.curvature[i]) * credit);
    }
  }

  static constexpr Row kDelayWalks = column(Grid::kModels, &NoiseModel::delay_walk, kDelayWalk);

  Row x_{}, y_{}, d_{}, xx_{}, xy_{}, xd_{}, yy_{}, yd_{}, dd_{};
};

}  // namespace ftcs::estimation
