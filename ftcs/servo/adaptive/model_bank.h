// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "ftcs/servo/adaptive/delay_shape.h"
#include "ftcs/servo/adaptive/noise_model.h"
#include "ftcs/servo/adaptive/quick_log.h"

namespace ftcs::adaptive {

/// One timestamp pair as the filters see it: z = free running - reference - base, in ns.
struct Observation {
  double sign = 1.0;     ///< +1 forward, -1 backward
  double elapsed = 0.0;  ///< cycles since the previous event; negative if it happened earlier
  double z = 0.0;        ///< = x + sign (d + n): x offset at the event, d path delay, n delay noise
};

/// Mean and covariance of one filter: offset x (ns), its drift y (ns per cycle), path delay d (ns);
/// covariances in units of s^2.
struct Estimate {
  double x = 0.0, y = 0.0, d = 0.0;
  double xx = 0.0, xy = 0.0, xd = 0.0, yy = 0.0, yd = 0.0, dd = 0.0;
};

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

  /// What one observation says about every model.
  struct Innovations {
    Row centred;      ///< nu less the mean delay noise, ns
    Row variance;     ///< its predicted variance, ns^2
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
    double largest = 0.0;
    for (std::size_t i = 0; i < kSize; ++i) {
      const NoiseModel& model = Grid::kModels[i];
      x_[i] += y_[i] * t;
      xx_[i] += 2.0 * t * xy_[i] + t * t * yy_[i] + model.white_fm * span +
                model.random_walk_fm * span * span * span / 3.0;
      xy_[i] += t * yy_[i] + model.random_walk_fm * t * span / 2.0;
      xd_[i] += t * yd_[i];
      yy_[i] += model.random_walk_fm * span;
      dd_[i] += (kDelayWalk + model.delay_walk) * span;
      largest = std::max(largest, std::max(std::max(xx_[i], yy_[i]), dd_[i]));
    }
    if (largest <= kLargestVariance) return true;
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
    bool suspicious = false;
    for (std::size_t i = 0; i < kSize; ++i) {
      const double predicted = xx_[i] + 2.0 * seen.sign * xd_[i] + dd_[i];
      const double variance = s2 * (predicted + shape.variance) + tail * tail;
      const double centred = seen.sign * (seen.z - x_[i]) - d_[i] - tail;
      const double curvature = 1.0 / variance;
      out.centred[i] = centred;
      out.variance[i] = variance;
      out.predicted[i] = predicted;
      out.slope[i] = centred * curvature;
      out.curvature[i] = curvature;
      out.credit[i] = 1.0;
    }
    for (std::size_t i = 0; i < kSize; ++i) {
      const double distance = out.centred[i] * out.slope[i];
      out.log_variance[i] = quick_log(out.variance[i]);
      out.log_density[i] = -0.5 * (distance + out.log_variance[i] + kLn2Pi);
      suspicious |= distance > kSuspicious;
    }
    if (tail > 0.0) judge_late(s2 * shape.variance, s2, tail, out);
    if (gate && suspicious) doubt(outliers, out);
    return out;
  }

  void correct(const Observation& seen, double scale, const Innovations& innovations) noexcept {
    const double s2 = scale * scale;
    for (std::size_t i = 0; i < kSize; ++i) {
      const double hx = xx_[i] + seen.sign * xd_[i];
      const double hy = xy_[i] + seen.sign * yd_[i];
      const double hd = xd_[i] + seen.sign * dd_[i];
      const double move = seen.sign * innovations.slope[i] * s2;
      const double shrink = innovations.curvature[i] * s2;
      x_[i] += hx * move;
      y_[i] += hy * move;
      d_[i] += hd * move;
      xx_[i] -= hx * hx * shrink;
      xy_[i] -= hx * hy * shrink;
      xd_[i] -= hx * hd * shrink;
      yy_[i] -= hy * hy * shrink;
      yd_[i] -= hy * hd * shrink;
      dd_[i] -= hd * hd * shrink;
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
    double sum = 0.0;
    double least = 1.0;
    for (std::size_t i = 0; i < kSize; ++i) {
      const Health health = health_of(i);
      sum += health.finite;
      least = std::min(least, health.positive);
    }
    return sum == 0.0 && least > 0.0;
  }
  /// Models that rounding or absurd input has broken take the state of `donor`, or of the first
  /// that is whole. False: there is none.
  [[nodiscard]] bool heal(std::size_t donor) noexcept {
    const auto whole = [this](std::size_t i) {
      const Health health = health_of(i);
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
    Estimate mean;
    for (std::size_t i = 0; i < kSize; ++i) {
      if (weight[i] == 0.0) continue;  // most of them
      mean.x += weight[i] * x_[i];
      mean.y += weight[i] * y_[i];
      mean.d += weight[i] * d_[i];
    }
    const double per_s2 = 1.0 / (scale * scale);
    for (std::size_t i = 0; i < kSize; ++i) {
      const double w = weight[i];
      if (w == 0.0) continue;
      const double dx = x_[i] - mean.x;
      const double dy = y_[i] - mean.y;
      const double dd = d_[i] - mean.d;
      mean.xx += w * (xx_[i] + dx * dx * per_s2);
      mean.xy += w * (xy_[i] + dx * dy * per_s2);
      mean.xd += w * (xd_[i] + dx * dd * per_s2);
      mean.yy += w * (yy_[i] + dy * dy * per_s2);
      mean.yd += w * (yd_[i] + dy * dd * per_s2);
      mean.dd += w * (dd_[i] + dd * dd * per_s2);
    }
    return mean;
  }

  /// Beyond it a model knows nothing, and its variance after the next message would be rounding.
  static constexpr double kLargestVariance = 1e11;

 private:
  /// `finite` is zero or not a number; `positive` is the least of what has to be above zero.
  struct Health {
    double finite, positive;
  };
  [[nodiscard]] Health health_of(std::size_t i) const noexcept {
    // Not finite times zero is not a number, which no comparison survives.
    const double finite =
        0.0 * (x_[i] + y_[i] + d_[i] + xx_[i] + yy_[i] + dd_[i] + xy_[i] + xd_[i] + yd_[i]);
    const double minors = std::min(xx_[i] * yy_[i] - xy_[i] * xy_[i],
                                   xx_[i] * (dd_[i] + kDelayWalk) - xd_[i] * xd_[i]);
    return {finite, std::min(std::min(xx_[i], yy_[i]), std::min(dd_[i] + kDelayWalk, minors))};
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
    for (std::size_t i = 0; i < kSize; ++i) {
      const double centred = out.centred[i];
      if (centred * centred <= kSuspicious * out.variance[i]) continue;
      const double probability = centred > 0.0 ? outliers.late : outliers.early;
      const double outlier =
          probability / (10.0 * std::max(std::abs(centred), 3.0 * std::sqrt(out.variance[i])));
      const double density = std::exp(out.log_density[i]);
      out.credit[i] = density / (density + outlier);
      out.log_density[i] = std::log(density + outlier);
      out.slope[i] *= out.credit[i];
      out.curvature[i] *= out.credit[i];
    }
  }

  Row x_{}, y_{}, d_{}, xx_{}, xy_{}, xd_{}, yy_{}, yd_{}, dd_{};
};

}  // namespace ftcs::adaptive
