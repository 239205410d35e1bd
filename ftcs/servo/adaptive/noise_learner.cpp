// SPDX-License-Identifier: MIT
#include "ftcs/servo/adaptive/noise_learner.h"

#include <algorithm>
#include <cmath>

namespace ftcs::adaptive {
namespace {

/// Longest memory: shorter would cost accuracy, longer would not follow a change of load.
constexpr double kMemory = 1000.0;
/// A sample further from the median than this is an outlier for the purpose of learning, whatever
/// the gate thinks: the gate's own judgement must not decide what noise looks like.
constexpr double kAcceptSigmas = 12.0;
/// Variance above this times the robust one: the moments belong to the past.
constexpr double kStaleRatio = 9.0;
constexpr double kSquareLimit = 60.0;
/// Moments worth standardising by.
constexpr double kShapeSamples = 16.0;
/// Memory of the shape ratio in samples, and its bounds: one sample convinces nobody, and old
/// certainty must not outlive a change.
constexpr double kShapeMemory = 300.0;
constexpr double kShapeFloor = -15.0;
constexpr double kShapeStep = -6.0;
constexpr double kTailOn = 8.0;
constexpr double kTailOff = -2.0;

double normal_log_density(double w) noexcept { return -0.5 * w * w - 0.9189385332046727; }

}  // namespace

template <std::size_t Window>
bool NoiseLearner<Window>::learn(const NoiseSample& sample, const DelayShape& shape) noexcept {
  recent_.push(sample.innovation);
  if (recent_.size() < 8) return false;
  const double median = recent_.median();
  const double robust = kMadToSigma * recent_.median_deviation();
  if (recent_.full() && variance_ > kStaleRatio * robust * robust) {
    count_ = 8.0;
    variance_ = robust * robust;
    ratio_ = {};
    if (!has_tail_) mean_ = median;
  }
  const double noise = shape.total_variance();
  const bool acceptable = std::abs(sample.innovation - median) < kAcceptSigmas * robust &&
                          sample.settled && sample.predicted < noise / 2.0;
  if (!acceptable) return false;

  count_ += 1.0;
  const double share = 1.0 / std::min(count_, kMemory);
  const double difference = sample.innovation - mean_;
  mean_ += share * difference;
  const double own = noise / (sample.predicted + noise);
  const double limit = kSquareLimit * sample.robust_scale * sample.robust_scale * noise;
  variance_ +=
      share * (std::min(difference * (sample.innovation - mean_) * own, limit) - variance_);
  if (count_ >= kShapeSamples && variance_ > 0.0) {
    const double w = (sample.innovation - mean_) / std::sqrt(variance_);
    for (std::size_t i = 0; i < kTailShares.size(); ++i) {
      const double gain = standard_late_log_density(w, kTailShares[i]) - normal_log_density(w);
      ratio_[i] = std::max(kShapeFloor,
                           ratio_[i] * (1.0 - 1.0 / kShapeMemory) + std::max(kShapeStep, gain));
    }
  }
  return true;
}

template <std::size_t Window>
DelayShape NoiseLearner<Window>::decide() noexcept {
  const auto best =
      static_cast<std::size_t>(std::max_element(ratio_.begin(), ratio_.end()) - ratio_.begin());
  if (has_tail_ ? ratio_[best] < kTailOff : ratio_[best] > kTailOn) has_tail_ = !has_tail_;
  if (!has_tail_) return {variance_, 0.0};
  const double tail = kTailShares[best] * std::sqrt(variance_);
  return {variance_ - tail * tail, tail};
}

template class NoiseLearner<32>;

}  // namespace ftcs::adaptive
