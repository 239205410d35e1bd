// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_estimator.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/delay_shape.h"
#include "ftcs/estimation/lanes.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

double log_normal(double distance, double log_variance) noexcept {
  return -0.5 * (distance + log_variance + kLn2Pi);
}

}  // namespace

void FloorEstimator::restart() noexcept {
  locked_ = adopted_ = false;
  for (const Direction each : kDirections) paths_[each].early = 0.0F;
  search_.restart();
}

void FloorEstimator::record(const Observation& seen, double rate) noexcept {
  adopted_ = false;
  search_.hear({direction_of(seen), seen.z, 0.0, false, rate}, seen.elapsed);
}

double FloorEstimator::update(const Observation& seen, double rate) noexcept {
  adopted_ = false;
  double credit = 0.0;
  said_ = 0.0;
  if (locked_) credit = follow(seen);
  const double slope = locked_ ? mixed_.y : (search_.has_rate() ? search_.rate() : rate);
  search_.hear({direction_of(seen), seen.z, said_, credit > 0.5, slope}, seen.elapsed);
  look();
  return credit;
}

double FloorEstimator::follow(const Observation& seen) noexcept {
  Path& path = paths_[direction_of(seen)];
  ++count_;
  if (!bank_.predict(seen.elapsed, best_)) {
    locked_ = false;
    return 0.0;
  }
  const Bank::Innovations in = judge(seen, path);
  const double credit = in.credit[best_];
  const bool late = in.centred[best_] > 0.0;
  said_ = in.log_density[best_];
  testimony_ = {
      quick_exp(std::max(log_normal(in.distance[best_], in.log_variance[best_]), kLeastExponent)),
      0.0,
      path.share,
      path.recent_share,
      late,
      late && std::min(path.share, path.recent_share) < kNearlyAll,
      false};
  testimony_.waiting = late ? path.waits.at(in.centred[best_])
                            : (1.0 - credit) * quick_exp(std::max(said_, kLeastExponent));
  if (late) {
    const double mean = std::max(scale_, static_cast<double>(path.late_by));
    testimony_.like_last = static_cast<float>(-in.centred[best_] / mean - quick_log(mean));
  }
  const double s2 = scale_ * scale_;
  gain_ = credit * s2 * in.predicted[best_] / in.variance[best_];
  watch_jumps(seen, path, in);
  testimony_.offset_jump = jumps_.seeks_offset();
  bank_.correct(seen, scale_, in);
  if (!bank_.healthy() && !bank_.heal(best_)) {
    locked_ = false;
    return 0.0;
  }
  evidence_.add(in.distance, in.log_variance, credit, scale_);
  detect_changes(in);
  learn(path, paths_[opposite(direction_of(seen))], in);
  choose();
  return credit;
}

/// The density in the head of the class, for all models. A message may have waited, with the
/// probability 1 - c, and then says nothing of the clock. The mean and the variance that are left
/// are those of both cases together, but that no message makes what is known less:
///
///     slope' = c slope,   curvature' = c max(0, curvature - (1 - c) slope^2)
///
/// (the spread of probabilistic data association: Bar-Shalom and Tse, Automatica 11, 1975).
FloorEstimator::Bank::Innovations FloorEstimator::judge(const Observation& seen,
                                                        const Path& path) const noexcept {
  using V = Bank::V;
  const DelayShape noise{path.variance / (scale_ * scale_), 0.0};
  const double early = path.early_outliers();
  Bank::Innovations in = bank_.judge(seen, noise, scale_, {}, false);
  for (std::size_t i = 0; i < FloorGrid::kSize; i += Bank::kStep) {
    V other;
    for (std::size_t lane = 0; lane < Bank::kStep; ++lane) {
      const double nu = in.centred[i + lane];
      other[lane] = nu > 0.0 ? (1.0 - path.share) * path.waits.at(nu)
                             : early / any_size(nu, std::sqrt(in.variance[i + lane]));
    }
    const V log_density = larger<V>(load<V>(&in.log_density[i]), V{} + kLeastExponent);
    const V normal = path.share * quick_exp(log_density);
    const V density = normal + other;
    const V credit = normal / density;
    store(&in.log_density[i], quick_log(density));
    const V slope = load<V>(&in.slope[i]);
    const V spread = (V{} + 1.0 - credit) * slope * slope;
    store(&in.credit[i], credit);
    store(&in.slope[i], credit * slope);
    store(&in.curvature[i], credit * larger<V>(V{}, load<V>(&in.curvature[i]) - spread));
  }
  return in;
}

/// The watch has a picture of its own: all that is late is an outlier of any
/// size. What is believed is asked under the same.
void FloorEstimator::watch_jumps(const Observation& seen, const Path& path,
                                 const Bank::Innovations& in) noexcept {
  const OutlierPrior outliers{1.0 - path.share, path.early_outliers()};
  const DelayShape shape{path.variance / (scale_ * scale_), 0.0};
  const double distance = in.distance[best_];
  double log_density = log_normal(distance, in.log_variance[best_]);
  if (distance > kThreeSigma) {
    const double nu = in.centred[best_];
    const double outlier =
        (nu > 0.0 ? outliers.late : outliers.early) / any_size(nu, std::sqrt(in.variance[best_]));
    log_density = quick_log(quick_exp(std::max(log_density, kLeastExponent)) + outlier);
  }
  jumps_.follow({seen, shape, scale_, outliers, process_, true, true, bank_.estimate(best_),
                 distance, log_density});
}

/// Late messages that agree by chance or by the length of a frame are no jump.
/// It shows where none is at the floor any more, or where one was early by half
/// of the jump at least: by |dx| - dd, of the direction that it makes earlier.
bool FloorEstimator::shows_in_early(const Estimate& after) const noexcept {
  const Estimate& before = bank_.estimate(best_);
  const double jump = std::abs(after.x - before.x) - (after.d - before.d);
  return dry(kSure) || 2.0 * static_cast<double>(early_by_) > std::abs(jump);
}

/// One that takes the last one back before that was confirmed: both directions have a lower floor.
/// Where waits are whole fragments, one that is early here and one that waited for one more
/// fragment there look like a jump. (Not if messages would arrive there before they were sent: that
/// clock was put back.)
Estimate FloorEstimator::after_jump() noexcept {
  Estimate after = jumps_.estimate();
  const double jump = after.x - bank_.estimate(best_).x;
  const double size = std::abs(jump);
  const bool possible = after.d - size / 2.0 > -early_arrival();
  const bool undone = possible && std::abs(jump + static_cast<double>(jumped_)) < kSharp * size;
  jumped_ = undone ? 0.0F : static_cast<float>(jump);
  if (undone) {
    after.x -= jump / 2.0;
    after.d -= size / 2.0;
  }
  return after;
}

/// The clock has changed, it seems.
void FloorEstimator::expect_confirmation() noexcept {
  for (const Direction each : kDirections) {
    paths_[each].unseen = static_cast<std::uint8_t>(kSurmised);
  }
}

/// A message was at the floor. Once so many of each direction have confirmed a change, what was
/// heard before it is void: a window across it has the earliest of one direction from before, and
/// of the other from after it.
void FloorEstimator::confirm(Path& path) noexcept {
  if (path.unseen == 0) return;
  --path.unseen;
  if (paths_.forward.unseen + paths_.backward.unseen > 0) return;
  jumped_ = 0.0F;
  search_.restart();
}

void FloorEstimator::detect_changes(const Bank::Innovations& in) noexcept {
  const bool early = in.centred[best_] < 0.0;
  if (early && in.distance[best_] > kThreeSigma) {
    early_ = kLately;
    early_by_ = std::max(early_by_, static_cast<float>(-in.centred[best_]));
  } else if (early_ > 0 && --early_ == 0) {
    early_by_ = 0.0F;
  }
  if (early && in.credit[best_] < kUnlikely) search_.alarm();
  const std::uint32_t overtaken = detector_.add(in.log_density);
  const auto jump = jumps_.judge(detector_, best_);
  const bool shows = jump == JumpWatch::Verdict::kJumped && shows_in_early(jumps_.estimate());
  if (jump == JumpWatch::Verdict::kJumped && !shows) jumps_.clear();
  if (shows) {
    bank_.start(after_jump());
    detector_.clear();
    jumps_.clear();
    search_.alarm();
    expect_confirmation();
    return;
  }
  if (jump == JumpWatch::Verdict::kWait) return;
  // A message that waits says nothing of the clock, whichever model explains it, unless one that
  // was early showed as much.
  const bool waits = !early && in.credit[best_] < kUnlikely;
  if (waits && early_ == 0) return;
  // Where early outliers are usual one of them comes beside a message that waited by as much.
  const double early_part =
      std::max(paths_.forward.early_outliers(), paths_.backward.early_outliers());
  const bool usual = early_part > 2.0 * kSeldom;  // more than one lately
  const ChangeTrust trust{early_ > 0, false, true, usual ? kSure : 0.0};
  for (std::uint32_t left = overtaken; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    const std::size_t source =
        detector_.take_over(i, static_cast<double>(count_), in.log_density, trust).source;
    if (source == ChangeDetector<FloorGrid>::kNone) continue;
    if (waits && !shows_in_early(bank_.estimate(source))) continue;
    // A model so wild that it takes waits for the floor knows nothing better.
    if (scale_ * std::sqrt(bank_.estimate(source).xx) > kSharp * mean_wait_) continue;
    const double moved = bank_.estimate(source).x - bank_.estimate(i).x;
    if (i == best_ && moved * moved > kEightSigma * scale_ * scale_) expect_confirmation();
    bank_.set(i, bank_.estimate(source));
  }
}

void FloorEstimator::learn(Path& path, Path& other, const Bank::Innovations& in) noexcept {
  const double credit = in.credit[best_];
  const double nu = in.centred[best_];
  path.heard += 1.0;
  if (path.heard > kShortMemory) {
    const double rate = 1.0 / std::min(path.heard, kLoadMemory);
    path.share = std::clamp(path.share + rate * (credit - path.share), kSeldom, 1.0 - kSeldom);
  }
  path.recent_share = std::clamp(path.recent_share + (credit - path.recent_share) / kShortMemory,
                                 kSeldom, 1.0 - kSeldom);
  if (credit > 0.01) {
    path.members += credit;
    const double own = path.variance / in.variance[best_];
    const double square = std::min(nu * nu, kEightSigma * in.variance[best_]) * own;
    path.variance += credit / std::min(path.members, kLongMemory) * (square - path.variance);
  }
  learn_early(path, nu, credit);
  if (credit > 0.5) confirm(path);
  if (nu > 0.0 && credit < 0.99) path.waits.learn(nu, 1.0 - credit);
  const auto waited = static_cast<float>(std::max(0.0, nu) * (1.0 - credit));
  path.late_by += (waited - path.late_by) / static_cast<float>(kFew);
  learn_dry(path, other, credit);
  if (path.dry > kSure) search_.alarm();
}

/// While none of a direction has been at a floor that was found its share falls, as one over those
/// that were heard: the fit's own is asked, or it would never be dry.
void FloorEstimator::learn_dry(Path& path, Path& other, double credit) noexcept {
  path.there = credit >= kUnlikely;
  if (credit > 0.5) path.told = 0.0F;
  if (!path.there && path.dry == 0.0) other.there = false;
  const double share = std::max(path.share, static_cast<double>(path.told));
  path.dry = path.there ? 0.0 : path.dry - quick_log(1.0 - share);
}

/// Early by next to nothing beside the waits, and those after it are where they were. What is early
/// by as much as messages wait says that this is not the floor.
void FloorEstimator::learn_early(Path& path, double nu, double credit) noexcept {
  const auto part = static_cast<float>(1.0 / kLoadMemory);
  path.early -= part * path.early;
  const bool near = -nu < kSharp * static_cast<double>(path.mean_wait);
  if (nu < 0.0 && credit < kUnlikely && near) path.pending = true;
  if (credit > 0.5 && path.pending) {
    path.early += part;
    path.pending = false;
  }
}

bool FloorEstimator::proven() const noexcept {
  return std::min(paths_.forward.members, paths_.backward.members) > kProven;
}

double FloorEstimator::heard() const noexcept {
  return std::min(paths_.forward.heard, paths_.backward.heard);
}

bool FloorEstimator::young() const noexcept { return surmised() || !proven(); }

bool FloorEstimator::never_seen() const noexcept {
  return !proven() && std::min(paths_.forward.dry, paths_.backward.dry) > kSure;
}

bool FloorEstimator::seen_one_way() const noexcept {
  const auto seen = [](const Path& path) {
    return path.there && path.recent_share > kNearlyAll * path.share;
  };
  return seen(paths_.forward) || seen(paths_.backward);
}

bool FloorEstimator::recent() const noexcept { return heard() < kOutlierMemory; }

bool FloorEstimator::lost() const noexcept {
  const auto speaks = [](const Path& path) { return path.dry > 0.0 || path.there; };
  const bool early = kFarLarger * static_cast<double>(early_by_) > mean_wait_;
  return dry(kSure) && (early || !speaks(paths_.forward) || !speaks(paths_.backward));
}

bool FloorEstimator::dry(double nats) const noexcept {
  return paths_.forward.dry + paths_.backward.dry > nats;
}

void FloorEstimator::choose() noexcept {
  const double product = paths_.forward.variance * paths_.backward.variance;
  scale_ = std::max(least_noise_, std::sqrt(std::sqrt(product)));
  if (evidence_.messages() > 0.0) best_ = evidence_.weigh(weight_);
  mix();
}

void FloorEstimator::mix() noexcept {
  Row doubt;
  Evidence<FloorGrid>::lean(weight_, doubt);
  mixed_ = bank_.mixture(weight_, doubt, scale_);
  process_ = bank_.mean_noise(doubt);
}

FloorSearch::Rival FloorEstimator::rival() const noexcept {
  if (!locked_) return {};
  const double ahead = std::max(least_noise_, noise_ns(Direction::kForward));
  const double back = std::max(least_noise_, noise_ns(Direction::kBackward));
  const bool uneven = kMuch * std::min(ahead, back) < std::max(ahead, back);
  return {true,
          found_,
          uneven,
          mixed_.x,
          scale_ * std::sqrt(std::max(0.0, mixed_.xx)),
          mixed_.y,
          mixed_.d > 0.0 ? -early_arrival() : FloorSearch::Rival{}.least_delay,
          scale_,
          {paths_.forward.share, paths_.backward.share}};
}

void FloorEstimator::look() noexcept {
  if (!search_.look(rival(), least_noise_)) return;
  adopt(search_.found());
  search_.adopt();
}

double FloorEstimator::noise_ns(Direction direction) const noexcept {
  return std::sqrt(paths_[direction].variance);
}

double FloorEstimator::offset_sigma_ns(double cycles) const noexcept {
  Estimate then = mixed_;
  then.elapse(std::max(0.0, cycles), {process_.white_fm, process_.random_walk_fm, 0.0});
  return scale_ * std::sqrt(std::max(then.xx, 0.0));
}

double FloorEstimator::likeliest_sigma_ns() const noexcept {
  return scale_ * std::sqrt(std::max(bank_.estimate(best_).xx, 0.0));
}

double FloorEstimator::rate_sigma_ns() const noexcept { return scale_ * std::sqrt(mixed_.yy); }
double FloorEstimator::delay_sigma_ns() const noexcept { return scale_ * std::sqrt(mixed_.dd); }

void FloorEstimator::rescale_time(double factor) noexcept {
  bank_.for_each([factor](Estimate& e) { e.rescale_time(factor); });
  mixed_.rescale_time(factor);
  jumps_.clear();
  search_.rescale_time(factor);
}

void FloorEstimator::shift_offset(double shift_ns) noexcept {
  bank_.for_each([shift_ns](Estimate& e) { e.x += shift_ns; });
  mixed_.x += shift_ns;
  jumps_.clear();
  search_.shift_offset(shift_ns);
}

}  // namespace ftcs::estimation
