// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "ftcs/estimation/model_bank.h"

namespace ftcs::estimation {

/// Weighted least squares of the messages' line z = x + y t + sign d: the
/// normal equations
///
///     [n  st  ss ] [x]   [sz ]
///     [st stt sts] [y] = [stz]        sums over messages of weight w; s: sign,
///     t: time in cycles [ss sts n  ] [d]   [ssz]
///
/// and their inverse, the covariance of (x, y, d) in units of the noise's
/// variance.
struct LineSums {
  double n = 0.0, t = 0.0, s = 0.0, tt = 0.0, ts = 0.0, z = 0.0, tz = 0.0, sz = 0.0;

  void add(double sign, double time, double reading, double weight = 1.0) noexcept {
    n += weight;
    t += weight * time;
    s += weight * sign;
    tt += weight * time * time;
    ts += weight * time * sign;
    z += weight * reading;
    tz += weight * time * reading;
    sz += weight * sign * reading;
  }

  /// All three. False: the messages do not determine them.
  [[nodiscard]] bool solve(Estimate& e) const noexcept {
    const double c00 = tt * n - ts * ts;
    const double c01 = ts * s - t * n;
    const double c02 = t * ts - tt * s;
    const double determinant = n * c00 + t * c01 + s * c02;
    if (!(determinant > 0.0)) return false;
    e.xx = c00 / determinant;
    e.xy = c01 / determinant;
    e.xd = c02 / determinant;
    e.yy = (n * n - s * s) / determinant;
    e.yd = (t * s - n * ts) / determinant;
    e.dd = (n * tt - t * t) / determinant;
    e.x = e.xx * z + e.xy * tz + e.xd * sz;
    e.y = e.xy * z + e.yy * tz + e.yd * sz;
    e.d = e.xd * z + e.yd * tz + e.dd * sz;
    return true;
  }

  /// Offset and rate alone; d stays what it is in `e`, and has been taken off
  /// the readings.
  [[nodiscard]] bool solve_with_known_delay(Estimate& e) const noexcept {
    const double determinant = n * tt - t * t;
    if (!(determinant > 0.0)) return false;
    e.xx = tt / determinant;
    e.xy = -t / determinant;
    e.yy = n / determinant;
    e.x = e.xx * z + e.xy * tz;
    e.y = e.xy * z + e.yy * tz;
    return true;
  }
};

}  // namespace ftcs::estimation
