// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>

#include "ftcs/estimation/lanes.h"

namespace ftcs::estimation {

/// Variances that a clock and a path gain per cycle, in units of s^2: one
/// number, or one for each lane.
template <class V>
struct ProcessNoise {
  V white_fm{};        ///< a: of the offset
  V random_walk_fm{};  ///< b: of the rate
  V delay_walk{};
};

/// Mean and covariance of a clock against its reference: offset x (ns), drift y
/// (ns per cycle) and path delay d (ns); covariances in units of s^2 (s: noise
/// of one timestamp). V is double: one filter; or a vector: as many filters as
/// it has lanes, each with the bits that it would have alone.
template <class V>
struct ClockState {
  V x{}, y{}, d{};
  V xx{}, xy{}, xd{}, yy{}, yd{}, dd{};

  /// t cycles later (negative: earlier; the noise grows by |t|):
  ///
  ///     x += y t,   P = F P F' + Q,   F = [1 t 0; 0 1 0; 0 0 1]
  ///     Q_xx = a |t| + b |t|^3 / 3,   Q_xy = b t |t| / 2,   Q_yy = b |t|,   Q_dd = walk |t|
  ///
  /// The exact discretisation of white FM (a) and random-walk FM (b) that act
  /// between the two instants.
  void elapse(double t, const ProcessNoise<V>& q) noexcept {
    const double span = std::abs(t);
    const double cube = span * span * span / 3.0;
    x = x + y * t;
    xx = xx + 2.0 * t * xy + t * t * yy + q.white_fm * span + q.random_walk_fm * cube;
    xy = xy + t * yy + q.random_walk_fm * (t * span / 2.0);
    xd = xd + t * yd;
    yy = yy + q.random_walk_fm * span;
    dd = dd + q.delay_walk * span;
  }

  /// Variance of what a message of the given sign says: h P h' with h = (1, 0,
  /// sign).
  [[nodiscard]] V variance_seen(double sign) const noexcept { return xx + 2.0 * sign * xd + dd; }
  /// nu = sign (z - h state): how late the message is.
  [[nodiscard]] V innovation(double sign, double z) const noexcept { return sign * (z - x) - d; }

  /// state += P h' sign slope s^2,  P -= P h' h P curvature s^2: minus the
  /// first and second derivative of the innovation's ln density. For normal
  /// noise nu / S and 1 / S: Kalman's.
  void absorb(double sign, double s2, const V& slope, const V& curvature) noexcept {
    const V hx = xx + sign * xd;
    const V hy = xy + sign * yd;
    const V hd = xd + sign * dd;
    const V move = slope * (sign * s2);
    const V shrink = curvature * s2;
    const V shrink_x = hx * shrink;
    const V shrink_y = hy * shrink;
    x = x + hx * move;
    y = y + hy * move;
    d = d + hd * move;
    xx = xx - hx * shrink_x;
    xy = xy - hy * shrink_x;
    xd = xd - hd * shrink_x;
    yy = yy - hy * shrink_y;
    yd = yd - hd * shrink_y;
    dd = dd - hd * hd * shrink;
  }

  /// The delay is less well known by `variance`, and the offset with it: x + sign d stays as it is.
  void doubt_delay(double sign, double variance) noexcept {
    xx = xx + variance;
    xd = xd - sign * variance;
    dd = dd + variance;
  }

  /// The unit of time becomes `factor` times as long.
  void rescale_time(double factor) noexcept {
    y = y * factor;
    xy = xy * factor;
    yd = yd * factor;
    yy = yy * (factor * factor);
  }
  /// The covariances as parts of another s^2.
  void rescale_covariance(double factor) noexcept {
    for (V* entry : {&xx, &xy, &xd, &yy, &yd, &dd}) *entry = *entry * factor;
  }

  /// Everything finite and the covariance positive. `pinned`: variance of d
  /// that is never zero. `finite` is zero or not a number; `positive` is the
  /// least of what has to be above zero.
  struct Health {
    V finite, positive;
  };
  [[nodiscard]] Health health(double pinned) const noexcept {
    // Not finite times zero is not a number, which no comparison survives.
    const V finite = 0.0 * (x + y + d + xx + yy + dd + xy + xd + yd);
    const V delay = dd + pinned;
    const V minors = lesser<V>(xx * yy - xy * xy, xx * delay - xd * xd);
    return {finite, lesser<V>(lesser<V>(xx, yy), lesser<V>(delay, minors))};
  }

  /// One of the lanes, and back.
  [[nodiscard]] ClockState<double> lane(std::size_t i) const noexcept {
    ClockState<double> one;
    each_entry(*this, one, [i](const V& from, double& to) { to = lane_of(from, i); });
    return one;
  }
  void set_lane(std::size_t i, const ClockState<double>& one) noexcept {
    each_entry(*this, one, [i](V& to, const double& from) { set_lane_of(to, i, from); });
  }

 private:
  template <class A, class B, class Do>
  static void each_entry(A& a, B& b, Do act) noexcept {
    act(a.x, b.x);
    act(a.y, b.y);
    act(a.d, b.d);
    act(a.xx, b.xx);
    act(a.xy, b.xy);
    act(a.xd, b.xd);
    act(a.yy, b.yy);
    act(a.yd, b.yd);
    act(a.dd, b.dd);
  }
};

/// One filter.
using Estimate = ClockState<double>;

}  // namespace ftcs::estimation
