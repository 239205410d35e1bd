// SPDX-License-Identifier: MIT
#include "ftcs/platform/rate_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr double kFinest = 40e-9;
constexpr double kCoarsest = 500e-9;
constexpr double kRatio = 1.03;
constexpr int kThresholds = 16;
// So long do two oscillators drift alike: the memory of what follows v.
constexpr double kDriftTimeNs = 8e9;
// Readings within this time are one.
constexpr double kBurstNs = 25e6;
// From one to the next, so that their difference says something of a rate.
constexpr double kShortestNs = 5e6;
// A command that stays away from where the models are good for so long has moved.
constexpr double kLongestOutsideNs = 1e9;
// Corrections until what is expected is worth anything, from then on until a reading may count as
// wrong, and until it is judged. A wrong reading that is believed bends what every model expects of
// the hundred that follow, and one of 1400 models always has a step that bends it back.
constexpr int kSettling = 50;
constexpr int kTrusting = 10;
constexpr int kFewest = 150;
constexpr int kMemory = 200;
// Models that have none; the second one's v is what the commands make up for.
constexpr std::size_t kDriftCompensated = 1;
constexpr std::size_t kWithoutSteps = 2;
constexpr double kUsualTimeNs = 1e9;
constexpr double kFarBetter = 0.5;
constexpr double kBetter = 0.8;  // of two with steps
// Nobody reads a clock more finely.
constexpr double kResolutionNs = 0.5;
constexpr double kOutlier = 5.0;  // mean deviations: four standard deviations

}  // namespace

double RateSteps::nearest(double command) const noexcept {
  if (size <= 0.0 || std::abs(command - threshold) > kReach) return command;
  return threshold + (std::floor((command - threshold) / size) + 0.5) * size;
}

RateStepMeter::RateStepMeter() {
  models_.resize(kWithoutSteps);
  for (double size = kFinest; size < kCoarsest; size *= kRatio) {
    for (int i = 0; i < kThresholds; ++i) models_.push_back({{size, size * i / kThresholds}});
  }
}

void RateStepMeter::restart() noexcept {
  for (Model& model : models_) model = {model.steps};
  begun_ = false;
  corrections_ = 0;
  burst_ = {};
  outside_ns_ = 0.0;
}

void RateStepMeter::forget() noexcept {
  believed_ = 0;
  restart();
}

void RateStepMeter::begin(double command, std::int64_t raw_ns, std::int64_t clock_ns) noexcept {
  begun_ = true;
  origin_raw_ns_ = raw_ns;
  origin_clock_ns_ = clock_ns;
  now_ns_ = corrected_ns_ = 0.0;
  usual_ = command;
  if (believed_ != 0) return;
  for (Model& model : models_) model.steps.threshold += command - centre_;
  centre_ = command;
}

void RateStepMeter::on_reading(double command, std::int64_t raw_ns,
                               std::int64_t clock_ns) noexcept {
  if (!begun_) begin(command, raw_ns, clock_ns);
  const std::int64_t elapsed = raw_ns - origin_raw_ns_;
  const auto now = static_cast<double>(elapsed);
  if (burst_.readings > 0 && now - burst_.first_ns > kBurstNs) {
    correct(command);
    if (!begun_) return;
  }
  if (burst_.readings == 0) burst_.first_ns = now;
  ++burst_.readings;
  burst_.sum_ns += now;
  burst_.sum_gained_ns += static_cast<double>(clock_ns - origin_clock_ns_ - elapsed);
}

void RateStepMeter::on_change(double command, std::int64_t raw_ns, double doubt_ns) noexcept {
  if (!begun_) return;
  if (doubt_ns > kResolutionNs) return restart();
  if (burst_.readings > 0) correct(command);
  if (begun_) advance(command, static_cast<double>(raw_ns - origin_raw_ns_));
}

void RateStepMeter::advance(double command, double to_ns) noexcept {
  const double elapsed = to_ns - now_ns_;
  now_ns_ = to_ns;
  for (Model& model : models_)
    model.expected_ns += (model.gain + model.steps.nearest(command)) * elapsed;
  models_[kDriftCompensated].expected_ns -= usual_ * elapsed;
  usual_ += (command - usual_) * std::min(elapsed / kUsualTimeNs, 1.0);
  const bool inside = std::abs(command - centre_) < RateSteps::kReach / 2.0;
  outside_ns_ = inside ? 0.0 : outside_ns_ + elapsed;
  if (outside_ns_ > kLongestOutsideNs) forget();
}

// Gains of the least squares fit of a line through n readings at equal distances (Bar-Shalom, Li
// and Kirubarajan 2001, 6.5), with n no more than what the memory holds.
void RateStepMeter::correct(double command) noexcept {
  const Burst burst = std::exchange(burst_, {});
  const double at = burst.sum_ns / burst.readings;
  advance(command, at);
  const double elapsed = at - corrected_ns_;
  if (!begun_ || elapsed < kShortestNs) return;
  corrected_ns_ = at;
  ++corrections_;
  const double n = std::min(corrections_ + 1.0, std::max(2.0, 2.0 * kDriftTimeNs / elapsed));
  const double of_offset = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0));
  const double of_gain = 6.0 / (n * (n + 1.0)) / elapsed;
  const double gained = burst.sum_gained_ns / burst.readings;
  for (Model& model : models_) {
    const double limit = largest_error_ns(model);
    const double error = std::clamp(gained - model.expected_ns, -limit, limit);
    model.expected_ns += of_offset * error;
    model.gain += of_gain * error;
    note_surprise(model, std::abs(error));
  }
  choose();
}

// A reading that was interrupted counts no more than this.
double RateStepMeter::largest_error_ns(const Model& model) const noexcept {
  if (corrections_ < kSettling + kTrusting) return std::numeric_limits<double>::infinity();
  return kOutlier * (model.surprise_ns + kResolutionNs);
}

void RateStepMeter::note_surprise(Model& model, double error_ns) const noexcept {
  if (corrections_ <= kSettling) return;
  const int count = std::min(corrections_ - kSettling, kMemory);
  model.surprise_ns += (error_ns - model.surprise_ns) / count;
}

void RateStepMeter::choose() noexcept {
  if (corrections_ < kSettling + kFewest) return;
  const auto best = std::ranges::min_element(models_, {}, &Model::surprise_ns);
  const auto is_better_than = [best](const Model& other, double share) {
    return best->surprise_ns + kResolutionNs < share * (other.surprise_ns + kResolutionNs);
  };
  const auto index = static_cast<std::size_t>(best - models_.begin());
  const bool both_have_steps = index >= kWithoutSteps && believed_ != 0;
  if (!is_better_than(models_[believed_], both_have_steps ? kBetter : kFarBetter)) return;
  if (index < kWithoutSteps) {
    believed_ = 0;
  } else if (both_have_steps || is_better_than(models_[kDriftCompensated], kFarBetter)) {
    believed_ = index;
  }
}

}  // namespace ftcs::platform
