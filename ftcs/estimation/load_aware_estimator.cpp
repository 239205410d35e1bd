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
/// followed until it falls below -kBeyondDoubt, and below -kMost it is given up.
constexpr double kBelieved = 25.0;
constexpr double kMost = kBeyondDoubt + kCertain;

}  // namespace

/// Of one message by the first picture, or of what it believes, if that is worse.
template <class Grid>
double LoadAwareEstimator<Grid>::plain_noise_ns() const noexcept {
  return std::max(plain_.spread_ns(), plain_.offset_sigma_ns(0.0));
}

/// What the first picture knows of the offset as the mean of its models says, without what it adds
/// to what it states.
template <class Grid>
double LoadAwareEstimator<Grid>::bare_sigma_ns() const noexcept {
  return plain_.scale() * std::sqrt(std::max(0.0, plain_.estimate().xx));
}

/// By how much the two differ in the offset, so many cycles from now.
template <class Grid>
double LoadAwareEstimator<Grid>::apart_ns(double ahead) const noexcept {
  const Estimate& floor = floor_.estimate();
  const Estimate& plain = plain_.estimate();
  return std::abs(floor.x - plain.x + ahead * (floor.y - plain.y));
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
  return bare_sigma_ns() < 2.0 * floor && apart * apart < kFiveSigma2 * floor * floor;
}

/// Messages at such a floor would arrive before they were sent, by more than latencies of stamps
/// that nobody calibrated make: a part of what messages wait.
template <class Grid>
bool LoadAwareEstimator<Grid>::impossible() const noexcept {
  const double early = -floor_.estimate().d;
  const double sigma = floor_.delay_sigma_ns();
  return !plain_.delay_was_known() && early > kSmallPart * floor_.mean_wait() &&
         early * early > kFiveSigma2 * sigma * sigma;
}

/// While the two contradict each other a contest is held: each predicts every message before it is
/// heard, S = max(0, S + ln p1 - ln p2), nats (a cumulative sum, Page, Biometrika 41, 1954). p1 is
/// the density that the first picture gave it, p2 that of the floor and its waits, or, where the
/// first is lost in a burst, of as long a wait as the last few, if that is greater. A picture that
/// is sharp by luck does not stay ahead; one that is right gains ten nats a message, since waits
/// are predicted badly. `anew`: the first one has just begun again from a line through the last
/// messages, which it explains; a hint.
template <class Grid>
void LoadAwareEstimator<Grid>::compare(double credit, double own, bool anew) noexcept {
  const double noise = plain_noise_ns();
  const bool finer = kMuch * noise < floor_.scale();
  const bool vague = noise > kMuch * floor_.scale();
  const double apart = apart_ns();
  together_ = apart < noise;
  // Lines that are about to part do. (One that is finding a change of the clock is heard first.)
  const double soon = floor_.early_lately() ? apart : std::max(apart, apart_ns(kFew));
  const bool contradicts = finer || (vague ? kMuch * noise : noise) < soon;
  // In a burst one that waits foretells the next: a picture lost among the waits leads by chance.
  const bool young = floor_.young();
  const bool lost_in_burst = !young && noise > kSharp * floor_.mean_wait() && lead() > kCertain;
  const auto like_last = static_cast<double>(floor_.testimony().like_last);
  const double waits = lost_in_burst ? like_last : kLeastExponent;
  const double better = plain_.log_density() - std::max(floor_.log_density(), waits);
  // A message that is where both say tells their noise apart, not them. (One that is at the floor
  // with a probability of a half or three quarters is not where that says.)
  const bool tells = finer || credit < 0.5 || own < kNearlyAll;
  const double gain = std::clamp(better, -kConvincing, tells ? kConvincing : 0.0);
  contest_ = contradicts ? std::max(anew ? kHint : 0.0, contest_ + gain) : 0.0;
  // An early message did not wait. A vague picture may lead while the floor finds by how much the
  // clock has jumped, which that does better.
  const bool early = own < 0.5 && !floor_.testimony().late;
  if (early && vague && contest_ > kCertain) doubt_floor();
  // One that was begun since a direction came late, and a message of the other is early: the clock
  // has changed.
  if (early && floor_.just_begun()) floor_.unlock();
  if (floor_.never_seen() && contest_ > 0.0 && lead() < kBeyondDoubt) floor_.unlock();
  // What the first picture explains alone and is late for the floor may have waited, for a whole
  // frame, or fragment, at a time: no end of a floor that is seen as often as before, nor, for a
  // picture that knows next to nothing, of one that one direction sees so while the other waits
  // through a burst. Noise far smaller than the floor's is none of a floor. One that is not
  // believed does no harm; if it looks for a jump it is left to.
  const double enough = young && (finer || floor_.dry(kConvincing)) ? kConvincing : kCertain;
  const bool dry = floor_.dry(floor_.recent() ? kHint : kConvincing);
  const bool one_way = kFarLarger * floor_.scale() < noise && floor_.seen_one_way();
  const bool unseen = dry && !one_way && (believed_ || !floor_.seeks_jump());
  const bool disproven = finer || unseen || (believed_ && young);
  if (contest_ > enough && credit > 0.5 && disproven) floor_.unlock();
}

/// It answers no more until it has convinced again.
template <class Grid>
void LoadAwareEstimator<Grid>::doubt_floor() noexcept {
  believed_ = false;
  lead_ = recent_lead_ = kCertain;
}

/// A floor has been found. One that has far more noise than the first picture is none. True: both
/// say the same, and the first one knows it.
template <class Grid>
bool LoadAwareEstimator<Grid>::welcome() noexcept {
  contest_ = 0.0;
  const double noise = plain_noise_ns();
  if (kMuch * noise < floor_.scale()) {
    floor_.unlock();
    return false;
  }
  // All models of a few messages leave more open than the first picture does, even one that is
  // lost.
  const bool known = agree() && bare_sigma_ns() < 2.0 * floor_.likeliest_sigma_ns();
  if (known) floor_.take_from(plain_.bank(), plain_.evidence(), plain_.scale());
  if (!believed_) doubt_floor();
  together_ = apart_ns() < noise;
  return known;
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
  contest_ = 0.0;
  together_ = false;
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
  if (floor_.locked() || !lucky_.found(direction)) return false;
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
/// resumes from it. What it gives up at once again, time after time, is none.
template <class Grid>
double LoadAwareEstimator<Grid>::give_up(const Observation& seen) noexcept {
  const bool goes_on = believed_ && !floor_.lost() && ++given_up_ <= kFew;
  const double own = goes_on ? floor_.update(seen, floor_.estimate().y) : 0.0;
  if (!goes_on || !floor_.locked()) {
    forget_floor();
    return 0.0;
  }
  contest_ = 0.0;
  plain_.resume(floor_.estimate(), floor_.scale());
  return believed_credit(own);
}

template <class Grid>
double LoadAwareEstimator<Grid>::update(const Observation& seen) noexcept {
  const std::uint32_t before = plain_.count();
  const double credit = plain_.update(seen);
  if (plain_.count() == 0) return give_up(seen);
  given_up_ = 0;
  if (!plain_.two_way() || plain_.known_delay().known()) {
    floor_.record(seen, plain_.estimate().y);
    return credit;
  }
  const bool followed = floor_.locked();
  if (credit < 0.5 && !followed) floor_.wake();
  const double own = floor_.update(seen, plain_.estimate().y);
  const bool begins = begins_to_wait(credit);
  if (begins && !floor_.locked() && start_floor(plain_.innovation_ns())) return credit;
  if (finds_lucky(direction_of(seen), credit)) return credit;
  bool agreed = false;
  if (floor_.adopted()) {
    agreed = welcome();
  } else if (followed && floor_.locked()) {
    compare(credit, own, plain_.count() <= before);
    // More that wait would open the gate of the first picture.
    agreed = credit < 0.5 && floor_.proven() && floor_.testimony().waited && agree();
  }
  if (followed && floor_.locked()) {
    const bool jumped = floor_.adopted() || floor_.testimony().offset_jump;
    const bool explains = own < 0.5 && credit > 0.5 && !jumped;
    follow_lead(direction_of(seen), explains);
  }
  if (floor_.locked() && (lead() <= -kMost || impossible())) floor_.unlock();
  const bool convinces = believed_ || agreed || lead() > kBelieved;
  believed_ =
      floor_.locked() && lead() >= -kBeyondDoubt && convinces && !lucky_.alike(plain_.spread_ns());
  return believed_ ? believed_credit(own) : credit;
}

/// What is early for the floor did not wait: that the first picture `explains` it alone speaks
/// against the floor, and not merely for nothing. (Unless the offset may have jumped: that makes
/// one direction early.)
template <class Grid>
void LoadAwareEstimator<Grid>::follow_lead(Direction direction, bool explains) noexcept {
  const FloorEstimator::Testimony& said = floor_.testimony();
  const double plain = quick_exp(std::max(plain_.log_density(), kLeastExponent));
  double& part = learnt_part_[direction];
  const double learnt = part * said.waiting;
  const bool early = explains && !said.late;
  const double waits = learnt + (1.0 - part) * plain;
  // Both say the same, the first one sharply beside the waits: to believe the floor costs nothing,
  // and what the next burst does to the first picture is not followed.
  const bool harmless =
      believed_ && together_ && kFarLarger * plain_noise_ns() < floor_.mean_wait();
  // One that has begun again in a burst of waits knows less than these: it foretells them by being
  // vague.
  const bool lost = believed_ && !plain_.settled() && plain_noise_ns() > floor_.mean_wait();
  const double least = harmless || lost ? 0.0 : -kMost;
  const auto follow = [&](double& lead, double share) {
    const double density = share * said.at_floor + (early ? said.waiting : (1.0 - share) * waits);
    const double gained = std::clamp(quick_log(density / plain), -kConvincing, kConvincing);
    lead = std::clamp(lead + gained, std::min(lead, least), kMost);
    return (1.0 - share) * waits / density;  // probability that it waited
  };
  const double waited = follow(lead_, said.share);
  (void)follow(recent_lead_, said.recent_share);
  if (early) return;
  part += (waited * learnt / waits - part * waited) / kLately;
  part = std::clamp(part, kNowAndThen, 1.0 - kNowAndThen);
}

template class LoadAwareEstimator<FullGrid>;

}  // namespace ftcs::estimation
