// SPDX-License-Identifier: MIT
#include "ftcs/servo/baseline/kalman_filter.h"

#include <algorithm>
#include <cmath>

namespace ftcs::baseline {
namespace {

// Before the first message nothing is known: 1 s of offset, 1000 ppm of rate, 1 ms of path delay.
constexpr double kInitialOffsetNs = 1e9;
constexpr double kInitialRateNsPerS = 1e6;
constexpr double kInitialDelayNs = 1e6;

constexpr double square(double x) noexcept { return x * x; }

}  // namespace

KalmanFilter::KalmanFilter(const KalmanNoise& noise, bool delay_known) noexcept
    : noise_(noise),
      xx_(square(kInitialOffsetNs)),
      yy_(square(kInitialRateNsPerS)),
      dd_(delay_known ? 0.0 : square(kInitialDelayNs)) {}

void KalmanFilter::predict(double elapsed_s) noexcept {
  const double t = elapsed_s;
  const double length = std::abs(t);
  const double white = square(noise_.white_fm_1s * 1e9);
  const double walk = square(noise_.random_walk_fm_1s * 1e9);
  state_.x += state_.y * t;
  xx_ += 2.0 * t * xy_ + t * t * yy_ + white * length + walk * length * t * t / 3.0;
  xy_ += t * yy_ + walk * length * t / 2.0;
  xd_ += t * yd_;
  yy_ += walk * length;
}

void KalmanFilter::update(double elapsed_s, double sign, double z) noexcept {
  predict(elapsed_s);
  const double noise = square(sign > 0.0 ? noise_.forward_ns : noise_.backward_ns);
  // P h' with h = (1, 0, g)
  const double px = xx_ + sign * xd_;
  const double py = xy_ + sign * yd_;
  const double pd = xd_ + sign * dd_;
  const double variance = px + sign * pd + noise;
  const double innovation = z - state_.x - sign * state_.d;
  const double kx = px / variance;
  const double ky = py / variance;
  const double kd = pd / variance;
  state_.x += kx * innovation;
  state_.y += ky * innovation;
  state_.d += kd * innovation;
  xx_ -= kx * px;
  xy_ -= kx * py;
  xd_ -= kx * pd;
  yy_ -= ky * py;
  yd_ -= ky * pd;
  dd_ -= kd * pd;
  gain_ = kx;
}

double KalmanFilter::offset_sigma_ns() const noexcept { return std::sqrt(std::max(xx_, 0.0)); }
double KalmanFilter::rate_sigma_ppb() const noexcept { return std::sqrt(std::max(yy_, 0.0)); }
double KalmanFilter::delay_sigma_ns() const noexcept { return std::sqrt(std::max(dd_, 0.0)); }

}  // namespace ftcs::baseline
