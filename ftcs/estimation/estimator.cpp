// SPDX-License-Identifier: MIT
#include "ftcs/estimation/estimator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/elementary.h"

namespace ftcs::estimation {
namespace {

/// Messages after which evidence counts, and noise may be learnt; before,
/// predictions are mostly prior.
constexpr std::uint32_t kEvidenceFrom = 3;
constexpr std::uint32_t kLearnFrom = 16;
/// Until then a change of the rate voids what was learnt, and nothing is settled.
constexpr std::uint32_t kYoung = kFew * kShortMemory;
/// The second opinion costs more than everything else: always early, later every so often.
constexpr std::uint8_t kOpinionOften = 32;
/// Residuals this many times below the innovations are not chance: with f
/// degrees of freedom the probability of such luck is about (f / 2 k^2)^(f/2) /
/// Gamma(f/2 + 1), below 1e-6 with sixteen messages.
constexpr double kContradiction = 10.0;
/// Filters that have only just started again have less to lose.
constexpr double kYoungContradiction = kContradiction / 2.0;
/// Filters that are settled and reject nothing are asked a million times, and a quarter of the
/// messages is left out: ten times comes by luck once in a quarter of a million messages.
constexpr double kSettledContradiction = 2.0 * kContradiction;

}  // namespace

template <class Grid>
bool Estimator<Grid>::observable() const noexcept {
  return two_way() || known_delay().known() || count_ > kFew;
}

template <class Grid>
void Estimator<Grid>::restart() noexcept {
  const KnownDelay delay = known_delay_;
  const double least_noise = least_noise_;
  const bool delay_freed = delay_freed_;
  ::new (static_cast<void*>(this))
      Estimator(delay);  // in place: too large for the stack of a real-time thread
  least_noise_ = least_noise;
  delay_freed_ = delay_freed;
}

template <class Grid>
void Estimator<Grid>::resume(const Estimate& known, double scale_ns) noexcept {
  restart();
  pinned_ = false;
  seen_ = {true, true};
  start_again({true, known, scale_ns});
  choose();
  mix();
}

/// Kept in the mixed estimate, which nobody else needs before the first
/// message.
template <class Grid>
void Estimator<Grid>::expect(const RatePrior& rate, double noise_ns) noexcept {
  scale_ = robust_scale_ = noise_ns;
  mixed_.y = rate.mean;
  mixed_.yy = rate.sigma * rate.sigma / (noise_ns * noise_ns);
}

template <class Grid>
void Estimator<Grid>::begin(std::size_t side) noexcept {
  Estimate start;
  start.xx = kUnknown;
  start.y = mixed_.y;
  start.yy = mixed_.yy > 0.0 ? mixed_.yy : kUnknown;
  if (const KnownDelay known = known_delay(); known.known()) {
    start.d = known.mean_ns;
    start.dd = known.sigma_ns * known.sigma_ns / (scale_ * scale_);
  } else {
    pinned_ = true;
  }
  bank_.start(start);
  seen_[side] = true;
  best_ = Grid::kStart;
}

/// With one direction only x + sign d is seen; d stays pinned to zero (no
/// cancellation of huge covariances). The first message of the other direction
/// sets it free: x = (x + sign d) - sign d.
template <class Grid>
void Estimator<Grid>::connect_second_direction(std::size_t side) noexcept {
  if (seen_[side]) return;
  seen_[side] = true;
  const double first_sign = side == 0 ? -1.0 : 1.0;  // of the other direction
  if (pinned_) unpin_delay(first_sign, kUnknown);
}

template <class Grid>
void Estimator<Grid>::unpin_delay(double first_sign, double variance) noexcept {
  pinned_ = false;
  bank_.for_each([=](Estimate& e) { e.doubt_delay(first_sign, variance); });
}

/// With so much doubt a first message that is late by more is an outlier; with
/// none at all it would be believed.
template <class Grid>
void Estimator<Grid>::free_delay(double sigma_ns) noexcept {
  delay_freed_ = true;
  if (count_ == 0 || two_way()) return;
  const double sigma = std::max(sigma_ns, least_noise_) / scale_;
  unpin_delay(seen_[0] ? 1.0 : -1.0, sigma * sigma);
}

template <class Grid>
void Estimator<Grid>::rescale_time(double factor) noexcept {
  bank_.for_each([factor](Estimate& e) { e.rescale_time(factor); });
  mixed_.rescale_time(factor);
  jumps_.clear();  // measured in the old unit
  second_opinion_.rescale_time(factor);
}

template <class Grid>
void Estimator<Grid>::shift_offset(double shift_ns) noexcept {
  bank_.for_each([shift_ns](Estimate& e) { e.x += shift_ns; });
  mixed_.x += shift_ns;
  jumps_.clear();
  second_opinion_.shift_offset(shift_ns);
}

template <class Grid>
double Estimator<Grid>::update(const Observation& seen) noexcept {
  const double credit = step(seen);
  if (!diverged_) return credit;
  const LastMessages last = second_opinion_.last();  // without this one
  restart();
  for (std::size_t k = 0; k < last.count; ++k) (void)step(last.messages[k]);
  return step(seen);
}

template <class Grid>
double Estimator<Grid>::step(const Observation& seen) noexcept {
  const std::size_t side = seen.sign > 0.0 ? 0 : 1;
  const double elapsed = count_ == 0 ? 0.0 : seen.elapsed;
  if (count_ == 0) begin(side);
  connect_second_direction(side);
  ++count_;
  ++since_change_;
  if (!bank_.predict(elapsed, best_) && count_ > kFew) {
    restart();
    return 0.0;
  }
  const OutlierPrior outliers{gate_.late_outliers(side), early_.probability(direction_of(seen))};
  const Innovations innovations = bank_.judge(seen, shape_[side], scale_, outliers, count_ > kFew);
  if (count_ > kLearnFrom) {
    jumps_.follow({seen, shape_[side], scale_, outliers, process_, two_way(), delay_free(),
                   bank_.estimate(best_), innovations.distance[best_],
                   innovations.log_density[best_]});
  }
  said_ = static_cast<float>(innovations.log_density[best_]);
  bank_.correct(seen, scale_, innovations);
  if (!bank_.healthy() && !bank_.heal(best_)) {  // absurd input
    restart();
    return 0.0;
  }

  const double credit = innovations.credit[best_];
  const double innovation = innovations.centred[best_] + scale_ * shape_[side].tail;
  innovation_ = static_cast<float>(innovation);
  const double predicted = innovations.predicted[best_];
  gain_ = static_cast<float>(credit * predicted / (predicted + shape_[side].total_variance()));
  if (count_ > kEvidenceFrom && observable()) {
    // The credit of the best model, for all: a model that rejected every
    // message as an outlier would otherwise gather no squares and look perfect.
    evidence_.add(innovations.distance, innovations.log_variance, credit, scale_);
  }
  if (count_ > kRepeated) heed(seen, innovations);
  if (follow_gate(side, credit, innovation)) {
    if (count_ == 0 || diverged_) return 0.0;
    hear_again(seen, outliers);
  }
  learn_noise(side, innovation, innovations);
  if (count_ > kEvidenceFrom) follow_surprise(side, innovations);
  seek_second_opinion(seen, innovation);
  choose();
  mix();
  return credit;
}

/// What one message says of outliers, and of a sudden change.
template <class Grid>
void Estimator<Grid>::heed(const Observation& seen, const Innovations& innovations) noexcept {
  const std::size_t side = seen.sign > 0.0 ? 0 : 1;
  const double credit = innovations.credit[best_];
  gate_.learn(side, credit);
  lateness_.observe(side, innovations.centred[best_] > 0.0, innovations.distance[best_]);
  using Message = EarlyMessages::Message;
  const bool early = innovations.centred[best_] < 0.0;
  const bool far = innovations.distance[best_] > kFarOff;
  const Message message = far ? (early ? Message::kEarly : Message::kLate)
                              : (credit >= 0.5 ? Message::kFits : Message::kNeither);
  const bool contradicted = early_.contradicted_by(direction_of(seen), early);
  const bool seconded = early_.seconded_by(direction_of(seen), early);
  if (early_.observe(direction_of(seen), message)) detector_.clear();
  const bool clock = (!two_way() || lateness_.speaks_of_clock()) && !contradicted;
  const bool suffices = early_.one_suffices() || count_ <= kOpinionOften;
  detect_changes(innovations.log_density, {clock, suffices, seconded});
}

template <class Grid>
void Estimator<Grid>::learn_noise(std::size_t side, double innovation,
                                  const Innovations& innovations) noexcept {
  // Of a clock that follows the reference most residuals are one of a few values, whole steps of
  // the stamps: of such the median is nothing where half are zero. A step q makes noise of
  // q / sqrt(6) where both stamps show it, of q / sqrt(12) where steering hides it in one.
  const double step = 3.0 * least_noise_;
  if (evidence_.messages() > 0.0 || count_ > kEvidenceFrom) {
    // What showed a change is not noise.
    if (since_change_ > 0) {
      const double dithered = innovations.centred[best_] + step * even_spread(count_);
      residuals_.push(scale_ * std::abs(dithered) / std::sqrt(innovations.variance[best_]));
    }
    follow_scale();
  }
  if (count_ > kLearnFrom) {
    const NoiseSample sample{innovation, innovations.predicted[best_], robust_scale_,
                             since_change_ > kLately, step};
    if (learner_[side].learn(sample, shape_[side])) {
      const auto taken = static_cast<std::uint32_t>(learner_[side].count());
      const std::size_t other = 1 - side;
      const bool all_mature =
          learner_[side].mature() && (!seen_[other] || learner_[other].mature());
      if (all_mature && taken % 16 == 0) adopt_shapes();
    }
  }
}

/// Not inlined: its innovations would lie on the stack of every message.
template <class Grid>
[[gnu::noinline]] void Estimator<Grid>::hear_again(const Observation& seen,
                                                   const OutlierPrior& outliers) noexcept {
  const DelayShape& shape = shape_[seen.sign > 0.0 ? 0 : 1];
  bank_.correct(seen, scale_, bank_.judge(seen, shape, scale_, outliers, true));
}

template <class Grid>
void Estimator<Grid>::seek_second_opinion(const Observation& seen, double innovation) noexcept {
  second_opinion_.push(seen, innovation);
  // So many rejections in a row of one direction, or innovations that hardly differ.
  if (std::max(gate_.most_rejected(), second_opinion_.serial()) >= kRepeated / 2)
    surprise_ = kOpinionOften;
  const bool first = count_ <= kOpinionOften;
  const bool fresh = first || evidence_.messages() < kOpinionOften;
  const bool due = first || count_ % kFew == 0 || surprise_ > 0;
  if (surprise_ > 0) --surprise_;
  if (!due) return;
  const bool young = fresh && second_opinion_.full();
  const bool content = settled() && gate_.most_rejected() == 0;
  const double usual = content ? kSettledContradiction : kContradiction;
  const double contradiction = young ? kYoungContradiction : usual;
  const FreshFit fit =
      second_opinion_.consult({delay_free(), known_delay().mean_ns, contradiction, least_noise_});
  if (fit.better) start_again(fit);
}

/// All filters from one estimate; what spoke for a change has been heard.
template <class Grid>
void Estimator<Grid>::begin_anew(const Estimate& start) noexcept {
  bank_.start(start);
  detector_.clear();
  jumps_.clear();
  lateness_.clear();
  gate_.explained();
  since_change_ = 0;
}

template <class Grid>
void Estimator<Grid>::start_again(const FreshFit& fit) noexcept {
  Estimate start = fit.estimate;
  scale_ = robust_scale_ = std::max(fit.scale_ns, least_noise_);
  if (const KnownDelay known = known_delay(); known.known()) {
    const double sigma = known.sigma_ns / scale_;
    start.dd = sigma * sigma;
    start.xx += start.dd;
  }
  begin_anew(start);
  for (auto& learner : learner_) learner.restart();
  shape_ = {};
  gate_ = {};
  residuals_.clear();
  evidence_.forget();
  second_opinion_.adopt(start);
  surprise_ = 0;
  unexplained_ = 0.0;
  count_ = kRepeated;
}

template <class Grid>
void Estimator<Grid>::detect_changes(const Row& log_density, const ChangeTrust& trust) noexcept {
  const std::uint32_t overtaken = detector_.add(log_density);
  const auto jump = jumps_.judge(detector_, best_);
  if (jump == JumpWatch::Verdict::kWait) return;
  if (jump == JumpWatch::Verdict::kJumped) {  // rate and noise are known as before
    begin_anew(jumps_.estimate());
    return;
  }
  // From calm to wild: every source stands behind its target and still has its
  // own state.
  for (std::uint32_t left = overtaken; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    const auto [source, alone] =
        detector_.take_over(i, static_cast<double>(count_), log_density, trust);
    if (source == ChangeDetector<Grid>::kNone) continue;
    bank_.set(i, bank_.estimate(source));
    if (i != best_) continue;
    early_.changed(alone);
    jumps_.clear();  // they were measured against what is no longer believed
    since_change_ = 0;
    if (count_ < kYoung) {  // a bad start must leave no trace
      for (auto& learner : learner_) learner.restart();
      residuals_.clear();
      evidence_.forget();
    }
  }
}

/// True if this message is to be heard once more, or if what was believed is
/// worth nothing.
template <class Grid>
bool Estimator<Grid>::follow_gate(std::size_t side, double credit, double innovation) noexcept {
  const Gate::Verdict verdict = gate_.observe(side, credit, innovation < 0.0, since_change_);
  if (verdict == Gate::Verdict::kShut) return false;
  diverged_ = verdict == Gate::Verdict::kDiverged;
  if (diverged_) return true;
  const double doubt = innovation * innovation / (scale_ * scale_);
  if (!(doubt < Bank::kLargestVariance)) {
    restart();
    return true;
  }
  const bool certain = verdict == Gate::Verdict::kOpenAlone;
  const bool delay_free = this->delay_free();
  const bool clock = !delay_free || certain || lateness_.speaks_of_clock();
  bank_.for_each([=](Estimate& e) {
    if (clock) e.xx += doubt;
    if (delay_free) e.dd += doubt;
  });
  return certain;
}

template <class Grid>
void Estimator<Grid>::choose() noexcept {
  if (count_ > kFew && evidence_.messages() > 0.0) {
    best_ = evidence_.weigh(weight_);
    wild_ = best_ >= Grid::kSudden ? static_cast<std::uint8_t>(wild_ + 1) : 0;
    if (wild_ < kOutlierMemory) return;
    // The wildest follow each message. Where one of them is believed for so long the calmer ones
    // may have lost the clock (to a reference that was finding its own time, say): they take all
    // that comes for outliers, and would for good. All begin where it is.
    wild_ = 0;
    bank_.start(bank_.estimate(best_));
    evidence_.forget();
  }
  weight_.fill(0.0);
  best_ = Grid::kStart;
  weight_[best_] = 1.0;
}

template <class Grid>
bool Estimator<Grid>::settled() const noexcept {
  return std::min(count_, since_change_) > kYoung && learner_[0].mature() && learner_[1].mature();
}

template class Estimator<FullGrid>;
template class Estimator<SmallGrid>;

}  // namespace ftcs::estimation
