// SPDX-License-Identifier: MIT
// Length: the order of the steps is the algorithm, and each reads the same
// small state.
#include "ftcs/estimation/estimator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>

#include "ftcs/measurement/order_statistic.h"

namespace ftcs::estimation {
namespace {

/// Start of offset (beyond the first reading), rate and delay, in units of s
/// and s per cycle: wide enough to be forgotten with the first message that
/// sees them.
constexpr double kOffsetPrior = 4e10;
constexpr double kRatePrior = 1e10;
constexpr double kDelayPrior = 1e10;
/// Four and a half sigma, squared: noise does so once in three hundred thousand
/// messages.
constexpr double kFarOff = 20.0;
/// Messages after which each of these may begin; before, every prediction is
/// still prior.
constexpr std::uint32_t kEvidenceFrom = 3;
constexpr std::uint32_t kMixFrom = 4;
constexpr std::uint32_t kJudgeFrom = 6;
constexpr std::uint32_t kLearnFrom = 16;
constexpr std::uint32_t kYoung = 100;
/// Where the noise is known: a host that stands still makes more than half of
/// the window late now and then, and its milliseconds must not become the noise
/// at once.
constexpr double kLargestResidual = 30.0;
/// The second opinion costs more than everything else: always early, later
/// every so often.
constexpr std::uint32_t kOpinionOften = 32;
constexpr std::uint8_t kOpinionPeriod = 4;
constexpr std::uint8_t kOpinionWhile = 16;
/// Residuals this many times below the innovations are not chance: with f
/// degrees of freedom the probability of such luck is about (f / 2 k^2)^(f/2) /
/// Gamma(f/2 + 1), below 1e-6 with sixteen messages. Filters that have only
/// just started again have less to lose.
constexpr double kContradiction = 10.0;
constexpr double kYoungContradiction = 5.0;
/// Filters that are settled and reject nothing are asked a million times, and a quarter of the
/// messages is left out: ten times comes by luck once in a quarter of a million messages.
constexpr double kSettledContradiction = 20.0;
/// Rejections in a row of one direction, or innovations that hardly differ,
/// after which it is asked every time for a while.
constexpr int kSurprises = 3;

std::size_t index_of(Direction direction) noexcept {
  return direction == Direction::kForward ? 0 : 1;
}
/// Six messages: short enough for the three or four that follow a change, long
/// enough not to follow the noise. Its usual fluctuation stays below 1.6.
constexpr double kSurpriseShare = 1.0 / 6.0;
constexpr double kUsualSurprise = 1.6;
constexpr double kSurpriseLimit = 100.0;
/// Variances of both directions that differ by less are of one kind of load.
constexpr double kAlike = 4.0;
/// The sharpest shape tried has a normal part of a seventh of the tail. Where
/// that is the best shape the true edge is anything between that soft and as
/// sharp as can be, and then the filter puts the floor 5.4 % of the tail too
/// late (measured). Taken back is the middle; what is open is as much.
constexpr double kEdgeBias = 0.027;
constexpr double kFloorDoubt = 0.03;
constexpr double kSharpest = 0.97;

double sign_of(std::size_t side) noexcept { return side == 0 ? 1.0 : -1.0; }

/// Noise of one kind: what it is, a queue or outliers, is decided for both
/// directions at once. One that alone took its noise for a queue would move the
/// offset by half a tail.
bool alike(double variance, double other) noexcept {
  return std::max(variance, other) < kAlike * std::min(variance, other);
}

/// Geometric mean of the standard deviations of one or both directions, of the
/// product of their variances.
double common_deviation(double variances, int sides) noexcept {
  const double root = std::sqrt(variances);
  return sides == 2 ? std::sqrt(root) : root;
}

}  // namespace

template <class Grid>
bool Estimator<Grid>::observable() const noexcept {
  return two_way() || known_delay().known() || count_ > kMixFrom;
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
  start.xx = kOffsetPrior;
  start.y = mixed_.y;
  start.yy = mixed_.yy > 0.0 ? mixed_.yy : kRatePrior;
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
  if (pinned_) unpin_delay(-sign_of(side), kDelayPrior);
}

template <class Grid>
void Estimator<Grid>::unpin_delay(double first_sign, double variance) noexcept {
  pinned_ = false;
  bank_.for_each([=](Estimate& e) {
    e.xx += variance;
    e.xd -= first_sign * variance;
    e.dd += variance;
  });
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
  if (!bank_.predict(elapsed, best_) && count_ > kMixFrom) {
    restart();
    return 0.0;
  }
  const OutlierPrior outliers{gate_.late_outliers(side), early_.probability(direction_of(seen))};
  const Innovations innovations =
      bank_.judge(seen, shape_[side], scale_, outliers, count_ > kMixFrom);
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
  if (count_ > kJudgeFrom) {
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
  if (follow_gate(side, credit, innovation)) {
    if (count_ == 0 || diverged_) return 0.0;
    hear_again(seen, outliers);
  }
  if (evidence_.messages() > 0.0 || count_ > kEvidenceFrom) {
    // What showed a change is not noise.
    const double size = std::sqrt(innovations.distance[best_]);
    const double most = learner_[side].mature() ? kLargestResidual : size;
    if (since_change_ > 0) residuals_.push(scale_ * std::min(size, most));
    follow_scale();
  }
  if (count_ > kLearnFrom) {
    const NoiseSample sample{innovation, predicted, robust_scale_, since_change_ > 8};
    if (learner_[side].learn(sample, shape_[side])) {
      const auto taken = static_cast<std::uint32_t>(learner_[side].count());
      const std::size_t other = 1 - side;
      const bool all_mature =
          learner_[side].mature() && (!seen_[other] || learner_[other].mature());
      if (all_mature && taken % 16 == 0) adopt_shapes();
    }
  }
  if (count_ > kEvidenceFrom) follow_surprise(side, innovations);
  seek_second_opinion(seen, innovation);
  choose();
  mix();
  return credit;
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
  if (gate_.most_rejected() >= kSurprises || second_opinion_.serial() >= kSurprises)
    surprise_ = kOpinionWhile;
  const bool due = count_ <= kOpinionOften || count_ % kOpinionPeriod == 0 || surprise_ > 0;
  if (surprise_ > 0) --surprise_;
  if (!due) return;
  const bool young =
      (count_ <= kOpinionOften || evidence_.messages() < kOpinionOften) && second_opinion_.full();
  const bool content = settled() && gate_.most_rejected() == 0;
  const double usual = content ? kSettledContradiction : kContradiction;
  const double contradiction = young ? kYoungContradiction : usual;
  const FreshFit fit =
      second_opinion_.consult({delay_free(), known_delay().mean_ns, contradiction});
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
  surprise_level_ = 1.0;
  count_ = kJudgeFrom;
}

template <class Grid>
void Estimator<Grid>::detect_changes(const Row& log_density, const ChangeTrust& trust) noexcept {
  const std::uint32_t overtaken = detector_.add(log_density);
  const auto jump = jumps_.judge(detector_.lead(best_));
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
  const bool certain = verdict == Gate::Verdict::kCertain;
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
  if (count_ > kMixFrom && evidence_.messages() > 0.0) {
    best_ = evidence_.weigh(weight_);
    return;
  }
  weight_.fill(0.0);
  best_ = Grid::kStart;
  weight_[best_] = 1.0;
}

/// ns by which the filters put the floor of a direction too late.
template <class Grid>
double Estimator<Grid>::edge_bias_ns(std::size_t side) const noexcept {
  const DelayShape& shape = shape_[side];
  const bool sharp = shape.tail * shape.tail > kSharpest * shape.total_variance();
  return sharp ? kEdgeBias * shape.tail * scale_ : 0.0;
}

template <class Grid>
void Estimator<Grid>::mix() noexcept {
  mixed_ = bank_.mixture(weight_, scale_);
  const double ahead = edge_bias_ns(0);
  const double back = edge_bias_ns(1);
  if (delay_free()) {
    mixed_.x -= (ahead - back) / 2.0;
    mixed_.d -= (ahead + back) / 2.0;
  } else {
    mixed_.x -= ahead - back;
  }
  process_ = bank_.mean_noise(weight_);
}

template <class Grid>
void Estimator<Grid>::follow_scale() noexcept {
  if (residuals_.size() > 0) {
    robust_scale_ = std::max(least_noise_, kMadToSigma * residuals_.median());
  }
  if (evidence_.messages() > 4.0 &&
      evidence_.mean_square(best_) > 9.0 * robust_scale_ * robust_scale_) {
    // Old gross errors are all that the evidence tells. The model that has
    // coped is right by now; without evidence any other might be chosen.
    evidence_.forget();
    const Estimate coped = bank_.estimate(best_);
    bank_.for_each([&coped](Estimate& e) { e = coped; });
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
        e.dd += doubt;
        e.xd += sign * doubt;
      } else {
        e.x -= sign * shift;
      }
      e.xx += doubt;
    });
    learner_[side].move_mean(shift);
  }
  scale_ = common_deviation(product, sides);
  for (std::size_t side = 0; side < 2; ++side) {
    if (!seen_[side]) continue;
    shape_[side] = {in_ns[side].variance / (scale_ * scale_), in_ns[side].tail / scale_};
  }
}

/// Exponential mean of nu^2 / S of the best model. What is taken for an outlier
/// counts as far as outliers are not what one expects on this path.
template <class Grid>
void Estimator<Grid>::follow_surprise(std::size_t side, const Innovations& innovations) noexcept {
  const double normalised = std::min(innovations.distance[best_], kSurpriseLimit);
  const double credit = innovations.credit[best_];
  const double unexpected = std::max(0.0, 1.0 - gate_.late_outliers(side) / Gate::kOutlierStart);
  const double level = credit * normalised + (1.0 - credit) * (1.0 + unexpected * normalised);
  surprise_level_ += kSurpriseShare * (level - surprise_level_);
}

template <class Grid>
double Estimator<Grid>::widening() const noexcept {
  return std::max(1.0, surprise_level_ / kUsualSurprise);
}

/// Where the floor of a queueing delay lies is known to a few per cent of its
/// tail only; equal errors of both directions cancel in the offset. While it is
/// open whether there is a queue at all, the floor may be off by the whole
/// tail.
template <class Grid>
double Estimator<Grid>::floor_doubt_ns() const noexcept {
  const double share = two_way() ? 0.5 : 1.0;
  const double known = kFloorDoubt * (shape_[0].tail - (two_way() ? 1.0 : -1.0) * shape_[1].tail);
  const double ahead = learner_[0].tail_doubt() * shape_[0].tail;
  const double back = learner_[1].tail_doubt() * shape_[1].tail;
  return scale_ * share * std::sqrt(known * known + ahead * ahead + back * back);
}

template <class Grid>
double Estimator<Grid>::offset_sigma_ns(double cycles) const noexcept {
  Estimate then = mixed_;
  then.elapse(std::max(0.0, cycles), {process_.white_fm, process_.random_walk_fm, 0.0});
  const double floor = floor_doubt_ns();
  return std::sqrt(scale_ * scale_ * widening() * std::max(then.xx, 0.0) + floor * floor);
}

template <class Grid>
bool Estimator<Grid>::settled() const noexcept {
  return std::min(count_, since_change_) > kYoung && learner_[0].mature() && learner_[1].mature();
}

template <class Grid>
double Estimator<Grid>::rate_sigma_ns() const noexcept {
  return scale_ * std::sqrt(widening() * mixed_.yy);
}

template <class Grid>
double Estimator<Grid>::delay_sigma_ns() const noexcept {
  return std::sqrt(scale_ * scale_ * widening() * mixed_.dd + floor_doubt_ns() * floor_doubt_ns());
}

template <class Grid>
double Estimator<Grid>::noise_ns(Direction direction) const noexcept {
  return scale_ * std::sqrt(shape_[index_of(direction)].total_variance());
}

template class Estimator<FullGrid>;
template class Estimator<SmallGrid>;

}  // namespace ftcs::estimation
