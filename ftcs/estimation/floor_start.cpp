// SPDX-License-Identifier: MIT
// How a floor begins: from what the search has found, or from what others know.
#include <algorithm>
#include <cmath>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/elementary.h"
#include "ftcs/estimation/floor_estimator.h"

namespace ftcs::estimation {
namespace {

/// Start of the filters that hear the members of a fit once more, in units of
/// its noise.
constexpr double kWide = 1e4;
/// The noise of a line contains what the oscillator did; the filters tell the two apart. A dozen
/// messages do so badly: wild models explain them with hardly any noise.
constexpr double kMostPart = 2.0;

}  // namespace

void FloorEstimator::begin(double scale, double wait) noexcept {
  scale_ = std::max(scale, least_noise_);
  mean_wait_ = wait;
  evidence_.forget();
  detector_.clear();
  jumps_.clear();
  weight_.fill(0.0);
  best_ = FloorGrid::kStart;
  weight_[best_] = 1.0;
  count_ = kLately;
  early_ = 0;
  early_by_ = jumped_ = 0.0F;
  locked_ = adopted_ = true;
}

void FloorEstimator::begin_path(Path& path, double share, double members, double wait) noexcept {
  path.share = path.recent_share = std::clamp(share, kSeldom, 1.0 - kSeldom);
  path.variance = scale_ * scale_;
  path.members = members;
  path.heard = path.dry = 0.0;
  path.there = path.pending = false;
  // A share that was surmised tells nothing.
  path.told = found_ ? static_cast<float>(path.share) : 0.0F;
  path.late_by = 0.0F;
  path.unseen = 0;
  path.mean_wait = static_cast<float>(wait);
  path.waits.start(wait);
}

void FloorEstimator::adopt(const FloorFit& fit) noexcept {
  begin(fit.sigma(), static_cast<double>(fit.mean_wait));
  found_ = true;
  hear_members_again(fit);
  for (const Direction direction : kDirections) {
    // The earliest of b messages is at the floor with probability 1 - (1 -
    // w)^b.
    const double entries = 1.0 / static_cast<double>(search_.stride());
    const double share =
        1.0 - portable_exp(entries * portable_log(1.0 - fit.noise[direction].share));
    begin_path(paths_[direction], share, std::min(fit.members[direction], kProven - 2.0),
               fit.noise[direction].mean_wait);
  }
  mix();
}

void FloorEstimator::start_from(const ModelBank<FullGrid>& bank, const Evidence<FullGrid>& evidence,
                                double scale, const PerDirection<double>& noise,
                                double wait) noexcept {
  begin(scale, wait);
  found_ = false;
  for (const Direction direction : kDirections) {
    begin_path(paths_[direction], kNearlyAll, kLongMemory / 10.0, wait);
    paths_[direction].variance = noise[direction] * noise[direction];
  }
  take_from(bank, evidence, scale);
}

/// Its level is known by repetition, which is proof enough.
void FloorEstimator::lower(Direction direction, double ns, double share) noexcept {
  Path& path = paths_[direction];
  path.share = path.recent_share = std::clamp(share, kSeldom, 1.0 - kSeldom);
  found_ = true;
  for (const Direction each : kDirections) paths_[each].heard = kSurmised;
  const double sign = sign_of(direction);
  bank_.for_each([=](Estimate& e) {
    e.x -= sign * ns / 2.0;
    e.d -= ns / 2.0;
  });
  mix();
}

/// The line's noise includes what the oscillator did meanwhile. Heard once
/// more, in order, the messages at the floor tell the two apart.
void FloorEstimator::hear_members_again(const FloorFit& fit) noexcept {
  double last = 0.0;
  int heard = 0;
  search_.each_member([&](Direction direction, double time, double z) {
    if (heard == 0) {
      Estimate start = fit.estimate;
      start.x = fit.offset_at(time);
      start.xx = start.dd = start.yy = kWide;
      start.xy = start.xd = start.yd = 0.0;
      bank_.start(start);
      last = time;
    }
    (void)bank_.predict(time - last, best_);
    last = time;
    const Observation seen{sign_of(direction), 0.0, z};
    const Bank::Innovations in = bank_.judge(seen, {}, scale_, {}, false);
    bank_.correct(seen, scale_, in);
    if (++heard > kFew) evidence_.add(in.distance, in.log_variance, 1.0, scale_);
  });
  if (heard == 0) {
    bank_.start(fit.estimate);
    return;
  }
  (void)bank_.predict(-last, best_);
  if (!(evidence_.messages() > 0.0)) return;
  best_ = evidence_.weigh(weight_);
  const double seen = std::sqrt(evidence_.mean_square(best_));
  scale_ = std::max(least_noise_, std::clamp(seen, scale_ / kMostPart, kMostPart * scale_));
}

void FloorEstimator::take_from(const ModelBank<FullGrid>& bank, const Evidence<FullGrid>& evidence,
                               double scale) noexcept {
  evidence_.take_from(evidence, FloorGrid::kInFull);
  const double units = scale * scale / (scale_ * scale_);
  for (std::size_t i = 0; i < FloorGrid::kSize; ++i) {
    Estimate e = bank.estimate(FloorGrid::kInFull[i]);
    e.rescale_covariance(units);
    bank_.set(i, e);
  }
  choose();
}

}  // namespace ftcs::estimation
