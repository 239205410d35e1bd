// SPDX-License-Identifier: MIT
#include "ftcs/estimation/noise_learner.h"

#include <algorithm>
#include <cmath>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/elementary.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/measurement/order_statistic.h"

namespace ftcs::estimation {
namespace {

/// A sample further from the median than this many sigma is an outlier for the
/// purpose of learning, whatever the gate thinks: the gate's own judgement must
/// not decide what noise looks like.
constexpr double kAcceptSigmas = 12.0;
/// Variance above this times the robust one: the moments belong to the past. A
/// third of the deviation (9) happens by chance to a window of 32 once in half
/// a million messages.
constexpr double kStaleRatio = 16.0;
/// Moments worth standardising by.
constexpr double kShapeSamples = 16.0;
/// Nats: one sample convinces nobody.
constexpr double kShapeStep = 6.0;
/// The alternative is a crude picture of outliers: where it explains half of
/// what a queue explains no queue is needed. Measured: queues lead by 0.2 nats
/// a message, bursts never.
constexpr double kDoubt = 2.0;
/// One window's median and median deviation are too noisy to judge by.
constexpr double kBodyMemory = 200.0;
constexpr double kTailOn = 8.0;
/// Nats beyond it that divide the doubt by e. Messages are not as independent
/// as nats assume: bursts have led by a dozen.
constexpr double kSureness = 16.0;
constexpr double kTailOff = -12.0;

double normal_log_density(double w) noexcept { return -0.5 * w * w - 0.5 * kLn2Pi; }

/// Normal but for some late outliers of any size: what bursts and detours make
/// of a path. Their moments look like queueing, but the floor of the delay is
/// not where queueing would put it.
double spoilt_log_density(double w) noexcept {
  const double outliers = w > 0.0 ? kUnlikely / any_size(w, 1.0) : 0.0;
  const double normal = quick_exp(std::max(normal_log_density(w), kLeastExponent));
  return quick_log((1.0 - kUnlikely) * normal + outliers);
}

}  // namespace

template <std::size_t Window>
bool NoiseLearner<Window>::learn(const NoiseSample& sample, const DelayShape& shape) noexcept {
  const double dithered = sample.innovation + sample.step * even_spread(++heard_);
  recent_.push(dithered);
  if (recent_.size() < kLately) return false;
  const double median = recent_.median();
  const double robust = kMadToSigma * recent_.median_deviation();
  if (recent_.full() && variance_ > kStaleRatio * robust * robust) {
    count_ = kLately;
    variance_ = robust * robust;
    ratio_ = {};
    spoilt_ = 0.0F;
    if (!has_tail_) mean_ = median;
  }
  const double noise = shape.total_variance();
  const bool acceptable = std::abs(sample.innovation - median) < kAcceptSigmas * robust &&
                          sample.settled && sample.predicted < noise / 2.0;
  if (!acceptable) return false;

  count_ += 1.0;
  const double share = 1.0 / std::min(count_, kLongMemory);
  const double difference = sample.innovation - mean_;
  mean_ += share * difference;
  const double own = noise / (sample.predicted + noise);
  const double limit = kEightSigma * sample.robust_scale * sample.robust_scale * noise;
  variance_ +=
      share * (std::min(difference * (sample.innovation - mean_) * own, limit) - variance_);
  const auto part = static_cast<float>(1.0 / std::min(count_, kBodyMemory));
  body_mean_ += part * (static_cast<float>(median) - body_mean_);
  body_deviation_ += part * (static_cast<float>(robust) - body_deviation_);
  if (count_ >= kShapeSamples && variance_ > 0.0 && body_deviation_ > 0.0F) {
    const double deviation = std::sqrt(variance_);
    const double w = (sample.innovation - mean_) / deviation;
    const double normal = normal_log_density(w);
    // Old certainty must not outlive a change.
    const auto follow = [normal](float& ratio, double log_density) {
      const double gain = std::clamp(log_density - normal, -kShapeStep, kShapeStep);
      const double kept = static_cast<double>(ratio) * (1.0 - 1.0 / kLoadMemory);
      ratio = static_cast<float>(std::max(-kSure, kept + gain));
    };
    for (std::size_t i = 0; i < kTailShares.size(); ++i) {
      follow(ratio_[i], standard_late_log_density(w, kTailShares[i]));
    }
    const double body = static_cast<double>(body_deviation_);
    const double from_body = (dithered - static_cast<double>(body_mean_)) / body;
    follow(spoilt_, spoilt_log_density(from_body) + quick_log(deviation / body));
  }
  return true;
}

template <std::size_t Window>
typename NoiseLearner<Window>::Case NoiseLearner<Window>::plead() const noexcept {
  Case said;
  for (std::size_t i = 0; i < ratio_.size(); ++i) said.queue[i] = static_cast<double>(ratio_[i]);
  said.outliers = std::max(static_cast<double>(spoilt_), 0.0);
  return said;
}

template <std::size_t Window>
DelayShape NoiseLearner<Window>::decide(const Case& said) noexcept {
  const auto best = static_cast<std::size_t>(
      std::max_element(said.queue.begin(), said.queue.end()) - said.queue.begin());
  const double lead = said.queue[best] - kDoubt * said.outliers;
  lead_ = static_cast<float>(lead);
  if (has_tail_ ? lead < kTailOff : lead > kTailOn) has_tail_ = !has_tail_;
  if (!has_tail_) return {variance_, 0.0};
  const double tail = kTailShares[best] * std::sqrt(variance_);
  return {variance_ - tail * tail, tail};
}

template <std::size_t Window>
double NoiseLearner<Window>::tail_doubt() const noexcept {
  const double sure = static_cast<double>(lead_) - kTailOn;
  return has_tail_ ? std::min(1.0, portable_exp(-sure / kSureness)) : 0.0;
}

template class NoiseLearner<32>;

}  // namespace ftcs::estimation
