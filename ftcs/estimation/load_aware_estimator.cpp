// SPDX-License-Identifier: MIT
#include "ftcs/estimation/load_aware_estimator.h"

#include <algorithm>
#include <cmath>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

/// Nats. One message counts at most kConvincing; a floor just found leads by
/// kCertain, since both directions convinced the search; above kBelieved it is
/// followed until it falls below -kBeyondDoubt, one not proven below
/// -kConvincing, and below -kMost it is given up.
constexpr double kBelieved = 25.0;
constexpr double kMost = kBeyondDoubt + kCertain;
/// Halves of messages that the first picture explains and the second does not:
/// four while it is sharp, two while it is much sharper, more while it is less
/// so; each that both explain takes one half away, unless they are far apart.
constexpr float kExplainedAlone = 2 * kFew;

/// How much smaller `noise` is than `other`: 1 from kFarLarger times on, 0 up to a kMuch-th of
/// that, between them by the logarithm: n messages agree by luck with the probability
/// (noise / other)^n.
double sharpness(double other, double noise) noexcept {
  const double ratio = kMuch / kFarLarger * other / noise;
  return ratio > 1.0 ? std::min(1.0, quick_log(ratio) / quick_log(kMuch)) : 0.0;
}

}  // namespace

/// Of one message by the first picture, or of what it believes, if that is worse.
template <class Grid>
double LoadAwareEstimator<Grid>::plain_noise_ns() const noexcept {
  return std::max(plain_.spread_ns(), plain_.offset_sigma_ns(0.0));
}

/// By how much the two differ in the offset.
template <class Grid>
double LoadAwareEstimator<Grid>::apart_ns() const noexcept {
  return std::abs(floor_.estimate().x - plain_.estimate().x);
}

template <class Grid>
void LoadAwareEstimator<Grid>::forget_floor() noexcept {
  floor_.restart();
  lead_ = recent_lead_ = 0.0;
  believed_ = false;
}

/// Both say the same of the offset, and the first picture, which has heard
/// everything, knows it no worse than the fit: to believe the floor then moves
/// nothing, and what comes late from now on will not either.
template <class Grid>
bool LoadAwareEstimator<Grid>::agree() const noexcept {
  const double apart = apart_ns();
  const double floor = floor_.offset_sigma_ns(0.0);
  const double plain = plain_.scale() * std::sqrt(std::max(0.0, plain_.estimate().xx));
  return plain < 2.0 * floor && apart * apart < kFiveSigma2 * floor * floor;
}

/// A floor that is not yet proven, and knows its offset much worse than the
/// first picture does, is contradicted: by messages, or because the two are far
/// apart. Its record holds messages from before a step of the clock.
template <class Grid>
bool LoadAwareEstimator<Grid>::overruled() const noexcept {
  const double noise = plain_noise_ns();
  const double apart = apart_ns();
  const bool contradicted = lead() < 0.0 || kFarLarger * noise < apart;
  return !floor_.proven() && contradicted && kMuch * noise < floor_.offset_sigma_ns(0.0);
}

/// Messages at such a floor would arrive before they were sent, by more than latencies of stamps
/// that nobody calibrated make: a part of what messages wait.
template <class Grid>
bool LoadAwareEstimator<Grid>::impossible() const noexcept {
  const double early = -floor_.estimate().d;
  const double sigma = floor_.delay_sigma_ns();
  return !plain_.delay_was_known() && early > kSmallPart * floor_.recent_wait() &&
         early * early > kFiveSigma2 * sigma * sigma;
}

/// Where messages wait the first picture is never as sharp as the waits are
/// long, nor as it is wrong. If it is, and explains what the floor does not, or
/// is much sharper than the floor, the floor is none.
template <class Grid>
void LoadAwareEstimator<Grid>::compare(double credit, double own) noexcept {
  const double noise = plain_noise_ns();
  const double apart = apart_ns();
  const bool contradicts = kFarLarger * noise < apart;
  const double sharp = noise < kMuch * floor_.scale()
                           ? 1.0
                           : sharpness(std::max(apart, floor_.recent_wait()), noise);
  const double sharper = sharpness(floor_.scale(), noise);
  const bool off = credit < 0.5;
  // One that is not so sharp must explain one message after the other.
  const bool interrupted = sharp < 1.0 && (off || off_);
  off_ = off;
  if (sharp <= 0.0 || interrupted || (own > 0.5 && off)) {
    explained_alone_ = 0.0F;
  } else if (!off && (own < 0.5 || sharper > 0.0)) {
    explained_alone_ += static_cast<float>(std::max(4.0 * sharper, own < 0.5 ? 2.0 * sharp : 0.0));
  } else if (own > 0.5 && !contradicts) {
    explained_alone_ = std::max(explained_alone_ - 1.0F, 0.0F);
  }
  explained_alone_ = std::min(explained_alone_, kExplainedAlone);
  // What the first picture explains alone and is late for the floor may have waited, for a whole
  // frame, or fragment, at a time: no end of a floor that is seen as often as before. An early one
  // did not wait, and noise far smaller than the floor's is none of a floor. One that is not
  // believed yet does no harm.
  const bool early = own < 0.5 && !floor_.testimony().late;
  const bool disproven = early || sharper > 0.0 || floor_.dry() ||
                         (believed_ && (!floor_.proven() || floor_.surmised()));
  if (explained_alone_ >= kExplainedAlone && disproven) floor_.unlock();
}

/// On a path that was settled: a second message of the last few that is late by
/// more than outliers explain, and none of them early.
template <class Grid>
bool LoadAwareEstimator<Grid>::begins_to_wait(double credit) noexcept {
  const bool off = credit < 0.5;
  const bool is_late = off && plain_.innovation_ns() > 0.0;
  const bool begins = is_late && late_ > 0 && plain_.settled();
  if (off) {
    late_ = is_late ? kLately : 0;
  } else if (late_ > 0) {
    --late_;
  }
  return begins;
}

/// False: no queue makes such waits.
template <class Grid>
bool LoadAwareEstimator<Grid>::start_floor(double wait) noexcept {
  if (!WaitDensity::holds(wait)) return false;
  const PerDirection<double> noise{plain_.noise_ns(Direction::kForward),
                                   plain_.noise_ns(Direction::kBackward)};
  floor_.start_from(plain_.bank(), plain_.evidence(), plain_.scale(), noise, wait);
  lead_ = recent_lead_ = 0.0;
  explained_alone_ = 0.0F;
  believed_ = true;
  return true;
}

/// The first picture is settled on messages that nearly all wait for the same, in one direction:
/// what it knows, with that direction's lucky messages for its floor, is followed.
template <class Grid>
bool LoadAwareEstimator<Grid>::finds_lucky(Direction direction, double credit) noexcept {
  if (believed_ || !plain_.settled()) {
    lucky_ = {};
    return false;
  }
  const double noise = plain_.noise_ns(direction);
  lucky_.observe(direction, credit > 0.5, -plain_.innovation_ns(), noise);
  if (floor_.locked() || !lucky_.found(direction, noise)) return false;
  if (!start_floor(lucky_.ns(direction))) return false;
  floor_.lower(direction, lucky_.ns(direction), lucky_.share(direction));
  lead_ = recent_lead_ = kCertain;
  return true;
}

/// That a message waited is news of the waits.
template <class Grid>
double LoadAwareEstimator<Grid>::believed_credit(double own) const noexcept {
  return floor_.testimony().waited ? 1.0 : own;
}

/// The first picture knows nothing any more. A long burst of waits does that
/// too: a floor that is believed, and not lost, goes on, and the first picture
/// resumes from it.
template <class Grid>
double LoadAwareEstimator<Grid>::give_up(const Observation& seen) noexcept {
  const bool goes_on = believed_ && !floor_.lost();
  const double own = goes_on ? floor_.update(seen, floor_.estimate().y) : 0.0;
  if (!goes_on || !floor_.locked()) {
    forget_floor();
    return 0.0;
  }
  explained_alone_ = 0.0F;
  resumed_ = kLately;
  plain_.resume(floor_.estimate(), floor_.scale());
  return believed_credit(own);
}

template <class Grid>
double LoadAwareEstimator<Grid>::update(const Observation& seen) noexcept {
  const double credit = plain_.update(seen);
  if (plain_.count() == 0) return give_up(seen);
  if (!plain_.two_way() || plain_.known_delay().known()) {
    floor_.record(seen, plain_.estimate().y);
    return credit;
  }
  const bool followed = floor_.locked();
  if (resumed_ > 0) --resumed_;
  if (credit < 0.5 && !followed) floor_.wake();
  const double own = floor_.update(seen, plain_.estimate().y);
  const bool begins = begins_to_wait(credit);
  if (begins && !floor_.locked() && start_floor(plain_.innovation_ns())) return credit;
  if (finds_lucky(direction_of(seen), credit)) return credit;
  bool agreed = false;
  if (floor_.adopted()) {
    explained_alone_ = 0.0F;
    agreed = agree();
    if (agreed) floor_.take_from(plain_.bank(), plain_.evidence(), plain_.scale());
    if (!believed_) lead_ = recent_lead_ = kCertain;
  } else if (followed && floor_.locked()) {
    if (resumed_ == 0) compare(credit, own);
    // More that wait would open the gate of the first picture.
    agreed = credit < 0.5 && floor_.proven() && floor_.testimony().waited && agree();
  }
  if (followed && floor_.locked()) follow_lead(direction_of(seen));
  if (floor_.locked() && (lead() <= -kMost || impossible())) floor_.unlock();
  const bool convinces = believed_ || agreed || lead() > kBelieved;
  const double least = floor_.proven() ? -kBeyondDoubt : -kConvincing;
  believed_ = floor_.locked() && lead() >= least && convinces && !overruled() &&
              !lucky_.alike(plain_.spread_ns());
  if (!believed_) return credit;
  return believed_credit(own);
}

template <class Grid>
void LoadAwareEstimator<Grid>::follow_lead(Direction direction) noexcept {
  const FloorEstimator::Testimony& said = floor_.testimony();
  const double plain = quick_exp(std::max(plain_.log_density(), kLeastExponent));
  double& part = learnt_part_[direction];
  const double learnt = part * said.waiting;
  const double waits = learnt + (1.0 - part) * plain;
  const auto follow = [&](double& lead, double share) {
    const double density = share * said.at_floor + (1.0 - share) * waits;
    const double gained = std::clamp(quick_log(density / plain), -kConvincing, kConvincing);
    lead = std::clamp(lead + gained, -kMost, kMost);
    return (1.0 - share) * waits / density;  // probability that it waited
  };
  const double waited = follow(lead_, said.share);
  (void)follow(recent_lead_, said.recent_share);
  part += (waited * learnt / waits - part * waited) / kLately;
  part = std::clamp(part, kNowAndThen, 1.0 - kNowAndThen);
}

template class LoadAwareEstimator<FullGrid>;

}  // namespace ftcs::estimation
