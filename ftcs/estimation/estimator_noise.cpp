// SPDX-License-Identifier: MIT
// The size and shape of the noise, and how far the estimate can be trusted.
#include <algorithm>
#include <array>
#include <cmath>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/estimator.h"
#include "ftcs/measurement/order_statistic.h"

namespace ftcs::estimation {
namespace {

/// The sharpest shape tried has a normal part of a seventh of the tail. Where
/// that is the best shape the true edge is anything between that soft and as
/// sharp as can be, and then the filter puts the floor 5.4 % of the tail too
/// late (measured). Taken back is the middle; what is open is as much.
constexpr double kEdgeBias = 0.027;
constexpr double kSharpest = 0.97;

bool sharp(const DelayShape& shape) noexcept {
  return shape.tail * shape.tail > kSharpest * shape.total_variance();
}
/// Of a queue whose floor is not seen: within the normal part of the noise, before the waits, it
/// may lie anywhere.
double edge_width(const DelayShape& shape) noexcept {
  return shape.tail > 0.0 && !sharp(shape) ? std::sqrt(shape.variance) : 0.0;
}

double sign_of(std::size_t side) noexcept { return side == 0 ? 1.0 : -1.0; }

std::size_t index_of(Direction direction) noexcept {
  return direction == Direction::kForward ? 0 : 1;
}
/// Noise of one kind: what it is, a queue or outliers, is decided for both
/// directions at once. One that alone took its noise for a queue would move the
/// offset by half a tail.
bool alike(double variance, double other) noexcept {
  return std::max(variance, other) < kMuch * std::min(variance, other);
}

/// Geometric mean of the standard deviations of one or both directions, of the
/// product of their variances.
double common_deviation(double variances, int sides) noexcept {
  const double root = std::sqrt(variances);
  return sides == 2 ? std::sqrt(root) : root;
}

}  // namespace

/// ns by which the filters put the floor of a direction too late.
template <class Grid>
double Estimator<Grid>::edge_bias_ns(std::size_t side) const noexcept {
  const DelayShape& shape = shape_[side];
  return sharp(shape) ? kEdgeBias * shape.tail * scale_ : 0.0;
}

template <class Grid>
void Estimator<Grid>::mix() noexcept {
  Row doubt;
  Evidence<Grid>::lean(weight_, doubt);
  mixed_ = bank_.mixture(weight_, doubt, scale_);
  const double ahead = edge_bias_ns(0);
  const double back = edge_bias_ns(1);
  if (delay_free()) {
    mixed_.x -= (ahead - back) / 2.0;
    mixed_.d -= (ahead + back) / 2.0;
  } else {
    mixed_.x -= ahead - back;
  }
  process_ = bank_.mean_noise(doubt);
}

template <class Grid>
void Estimator<Grid>::follow_scale() noexcept {
  if (residuals_.size() > 0) {
    robust_scale_ = std::max(least_noise_, kMadToSigma * residuals_.median());
  }
  // Fourth root of both directions' variances: the scale is their geometric
  // mean.
  double learnt = 1.0;
  double assumed = 1.0;
  int sides = 0;
  bool mature = true;
  for (std::size_t side = 0; side < 2; ++side) {
    if (!seen_[side]) continue;
    ++sides;
    mature = mature && learner_[side].mature();
    learnt *= learner_[side].variance();
    assumed *= shape_[side].total_variance();
  }
  scale_ = robust_scale_;
  if (!mature) return;
  const double wanted = common_deviation(learnt / assumed, sides);
  // What is learnt may be below what rounding makes: stamps that agree to the digit for seconds.
  scale_ = std::max(least_noise_, std::clamp(wanted, 0.6 * robust_scale_, 2.5 * robust_scale_));
}

/// Brings the learnt shapes into use. When a tail appears or goes, the zero of
/// the delay moves from the mean to the floor or back by `shift`; half of it
/// was offset, half path delay, known to about 30 per cent.
template <class Grid>
void Estimator<Grid>::adopt_shapes() noexcept {
  double product = 1.0;
  int sides = 0;
  std::array<DelayShape, 2> in_ns{};
  std::array<typename NoiseLearner<Grid::kNoiseWindow>::Case, 2> said{learner_[0].plead(),
                                                                      learner_[1].plead()};
  if (two_way() && alike(learner_[0].variance(), learner_[1].variance())) {
    said[0].add(said[1]);
    said[1] = said[0];
  }
  for (std::size_t side = 0; side < 2; ++side) {
    if (!seen_[side]) continue;
    ++sides;
    const double old_tail = scale_ * shape_[side].tail;
    in_ns[side] = learner_[side].decide(said[side]);
    in_ns[side].variance = std::max(in_ns[side].variance, least_noise_ * least_noise_);
    product *= in_ns[side].total_variance();
    const bool switched = (old_tail > 0.0) != (in_ns[side].tail > 0.0);
    if (!switched) continue;
    const double shift = in_ns[side].tail - old_tail;
    const double sign = sign_of(side);
    const bool delay_free = this->delay_free();
    const double doubt = 0.09 * shift * shift / (scale_ * scale_) / (delay_free ? 4.0 : 1.0);
    bank_.for_each([=](Estimate& e) {
      if (delay_free) {
        e.d -= shift / 2.0;
        e.x -= sign * shift / 2.0;
        e.doubt_delay(-sign, doubt);
      } else {
        e.x -= sign * shift;
        e.xx += doubt;
      }
    });
    learner_[side].move_mean(shift);
  }
  scale_ = common_deviation(product, sides);
  for (std::size_t side = 0; side < 2; ++side) {
    if (!seen_[side]) continue;
    shape_[side] = {in_ns[side].variance / (scale_ * scale_), in_ns[side].tail / scale_};
  }
  if (delay_free()) doubt_delay();
}

/// Of n messages (half of all) whose noise, waits apart, has the deviation r, x + sign d is known
/// to r / sqrt(n) at best (Cramer and Rao's bound), and the delay to half of that, however well the
/// other direction is known. Filters that took both for one size of noise at first believe more, in
/// the direction that leaves the quieter one's x + sign d as it is.
template <class Grid>
void Estimator<Grid>::doubt_delay() noexcept {
  const std::size_t noisy = shape_[0].variance > shape_[1].variance ? 0 : 1;
  const double messages = static_cast<double>(count_) / 2.0;
  const double least = shape_[noisy].variance / (4.0 * messages);
  const double sign = sign_of(1 - noisy);
  bank_.for_each([=](Estimate& e) { e.doubt_delay(sign, std::max(0.0, least - e.dd)); });
}

/// What the noise does not explain of the last message's innovation the clock may have done since
/// the one before: max(0, c nu^2 - 4 S), ns^2, c the probability that it is no outlier. (Where
/// messages queue one that is late has waited.)
template <class Grid>
void Estimator<Grid>::follow_surprise(std::size_t side, const Innovations& innovations) noexcept {
  const bool waited = shape_[side].tail > 0.0 && innovations.centred[best_] > 0.0;
  const double square = innovations.credit[best_] * innovations.distance[best_];
  unexplained_ = waited ? 0.0 : std::max(0.0, square - kTwoSigma) * innovations.variance[best_];
}

/// Where the floor of a queueing delay lies is known to a few per cent of its
/// tail only; equal errors of both directions cancel in the offset. While it is
/// open whether there is a queue at all, the floor may be off by the whole
/// tail.
template <class Grid>
double Estimator<Grid>::floor_doubt_ns() const noexcept {
  const double share = two_way() ? 0.5 : 1.0;
  const double known = kEdgeBias * (shape_[0].tail - (two_way() ? 1.0 : -1.0) * shape_[1].tail);
  const double soft = edge_width(shape_[0]) - (two_way() ? 1.0 : -1.0) * edge_width(shape_[1]);
  const double ahead = learner_[0].tail_doubt() * shape_[0].tail;
  const double back = learner_[1].tail_doubt() * shape_[1].tail;
  return scale_ * share * std::sqrt(known * known + soft * soft + ahead * ahead + back * back);
}

template <class Grid>
double Estimator<Grid>::offset_sigma_ns(double cycles) const noexcept {
  Estimate then = mixed_;
  then.elapse(std::max(0.0, cycles), {process_.white_fm, process_.random_walk_fm, 0.0});
  const double floor = floor_doubt_ns();
  return std::sqrt(scale_ * scale_ * std::max(then.xx, 0.0) + unexplained_ + floor * floor);
}

template <class Grid>
double Estimator<Grid>::rate_sigma_ns() const noexcept {
  return scale_ * std::sqrt(mixed_.yy);
}

template <class Grid>
double Estimator<Grid>::delay_sigma_ns() const noexcept {
  return std::sqrt(scale_ * scale_ * mixed_.dd + floor_doubt_ns() * floor_doubt_ns());
}

template <class Grid>
double Estimator<Grid>::noise_ns(Direction direction) const noexcept {
  return scale_ * std::sqrt(shape_[index_of(direction)].total_variance());
}

template void Estimator<FullGrid>::mix() noexcept;
template void Estimator<FullGrid>::follow_scale() noexcept;
template void Estimator<FullGrid>::adopt_shapes() noexcept;
template void Estimator<FullGrid>::doubt_delay() noexcept;
template void Estimator<FullGrid>::follow_surprise(std::size_t, const Innovations&) noexcept;
template double Estimator<FullGrid>::offset_sigma_ns(double) const noexcept;
template double Estimator<FullGrid>::rate_sigma_ns() const noexcept;
template double Estimator<FullGrid>::delay_sigma_ns() const noexcept;
template double Estimator<FullGrid>::noise_ns(Direction) const noexcept;
template void Estimator<SmallGrid>::mix() noexcept;
template void Estimator<SmallGrid>::follow_scale() noexcept;
template void Estimator<SmallGrid>::adopt_shapes() noexcept;
template void Estimator<SmallGrid>::doubt_delay() noexcept;
template void Estimator<SmallGrid>::follow_surprise(std::size_t, const Innovations&) noexcept;
template double Estimator<SmallGrid>::offset_sigma_ns(double) const noexcept;
template double Estimator<SmallGrid>::rate_sigma_ns() const noexcept;
template double Estimator<SmallGrid>::delay_sigma_ns() const noexcept;
template double Estimator<SmallGrid>::noise_ns(Direction) const noexcept;

}  // namespace ftcs::estimation
