// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs::baseline {

/// How a free-running clock wanders, and how noisy its timestamps are: constants, never learnt.
struct KalmanNoise {
  double forward_ns = 100.0;        ///< one forward message, standard deviation; > 0
  double backward_ns = 100.0;       ///< one backward message
  double white_fm_1s = 0.0;         ///< Allan deviation at 1 s of white FM
  double random_walk_fm_1s = 1e-9;  ///< frequency step of random-walk FM in one second
};

/// Offset x (ns, free running minus reference), rate y (ns/s) and path delay d (ns) under fixed
/// noise: the linear Kalman filter with
///
///     x' = y + white FM,   y' = random-walk FM,   d' = 0
///     z = x + g d + noise,   g = +1 forward, -1 backward
///
/// With a known delay (variance 0) it is the two-state filter. Process noise over an interval t
/// (Brown and Hwang; one-dimensional constant-velocity model): Q_xx = w t + q t^3/3, Q_xy = q
/// t^2/2, Q_yy = q t. Correction, with h = (1, 0, g) and R the message's variance:
///
///     S = h P h' + R,   K = P h' / S,   state += K (z - h state),   P -= K h P
///
/// Starts from zero with 1 s, 1000 ppm and 1 ms of standard deviation: offsets are given less a
/// base, so that they begin small.
class KalmanFilter {
 public:
  /// At the event of the last message: ns, ns/s, ns.
  struct State {
    double x = 0.0;
    double y = 0.0;
    double d = 0.0;
  };

  KalmanFilter(const KalmanNoise& noise, bool delay_known) noexcept;

  /// One message: seconds since the last one (may be negative by the path delay), sign g,
  /// observation z.
  void update(double elapsed_s, double sign, double z) noexcept;
  /// At the event of the last message.
  [[nodiscard]] const State& state() const noexcept { return state_; }
  /// Square roots of P's diagonal, after the last message.
  [[nodiscard]] double offset_sigma_ns() const noexcept;
  [[nodiscard]] double rate_sigma_ppb() const noexcept;
  [[nodiscard]] double delay_sigma_ns() const noexcept;
  /// Part of the last innovation that went into x.
  [[nodiscard]] double gain() const noexcept { return gain_; }

 private:
  void predict(double elapsed_s) noexcept;

  KalmanNoise noise_;
  State state_{};
  // Upper triangle of the covariance.
  double xx_;
  double xy_ = 0.0;
  double xd_ = 0.0;
  double yy_;
  double yd_ = 0.0;
  double dd_;
  double gain_ = 1.0;
};

}  // namespace ftcs::baseline
