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

/// The same with a frequency drift D: z = x + y t + D t^2 / 2 + sign d. What t^2 has that no line
/// has tells D, and the line is what is left of z (Frisch and Waugh, Econometrica 1, 1933):
///
///     D / 2 = (sum t^2 z - q'v) / s,   s = sum t^4 - q'u,   q = (sum t^2, sum t^3, sum sign t^2)'
///     line = v - u D / 2,   covariance = A^-1 + u u' / s        A u = q, A v = (sz, stz, ssz)'
struct DriftSums {
  LineSums line;
  double ttt = 0.0, tts = 0.0, tttt = 0.0, ttz = 0.0;

  /// All four. False: the messages do not determine them.
  [[nodiscard]] bool solve(Estimate& e, double& drift) const noexcept {
    LineSums square = line;
    square.z = line.tt;
    square.tz = ttt;
    square.sz = tts;
    Estimate u;
    if (!line.solve(e) || !square.solve(u)) return false;
    const double own = tttt - (u.x * line.tt + u.y * ttt + u.d * tts);
    if (!(own > 1e-9 * tttt)) return false;  // what rounding leaves
    const double half = (ttz - (e.x * line.tt + e.y * ttt + e.d * tts)) / own;
    drift = 2.0 * half;
    e.x -= half * u.x;
    e.y -= half * u.y;
    e.d -= half * u.d;
    e.xx += u.x * u.x / own;
    e.xy += u.x * u.y / own;
    e.xd += u.x * u.d / own;
    e.yy += u.y * u.y / own;
    e.yd += u.y * u.d / own;
    e.dd += u.d * u.d / own;
    return true;
  }
};

}  // namespace ftcs::estimation
