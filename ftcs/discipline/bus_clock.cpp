// SPDX-License-Identifier: MIT
#include "ftcs/discipline/bus_clock.h"

#include <algorithm>
#include <cmath>

#include "ftcs/time/relabel.h"

namespace ftcs {
namespace {

constexpr double kPpb = 1e-9;
/// Of the braking speed: the estimate is not exact.
constexpr double kBrakeReserve = 0.7;

AdaptiveConfig estimator_config(const BusClockConfig& config) noexcept {
  AdaptiveConfig result;
  result.sync_interval = config.sample_interval;
  result.fixed_path_delay = Nanoseconds{0};  // both readings are of one instant
  return result;
}

std::uint32_t cycles_per_sample(const BusClockConfig& config) noexcept {
  const std::int64_t cycles = config.sample_interval / config.cycle;
  return static_cast<std::uint32_t>(std::max<std::int64_t>(cycles, 1));
}

/// L: the system time less what was added to it.
FreeRunningTime crystal_of(const BusClockSample& sample) noexcept {
  return relabel<FreeRunningTime>(sample.dc - Duration::from_whole_ns(sample.offset_ns));
}

}  // namespace

std::string_view describe(BusConfigError error) noexcept {
  switch (error) {
    case BusConfigError::kCycle:
      return "the cycle must be longer than zero";
    case BusConfigError::kSync0Phase:
      return "SYNC0 comes 0 to 1 cycles after the frame";
    case BusConfigError::kSampleInterval:
      return "a sample interval is a cycle or more";
    case BusConfigError::kTimeConstant:
      return "the time constant must be longer than zero";
    case BusConfigError::kRateLimits:
      return "the rate limits need 0 < slowest <= 1 <= fastest";
    case BusConfigError::kPull:
      return "the largest pull must be above zero";
    case BusConfigError::kSlope:
      return "the largest slope must be above zero";
    case BusConfigError::kHoldover:
      return "holdover begins after one missed sample interval or more";
    case BusConfigError::kLock:
      return "the lock's band needs 0 <= enter <= leave";
  }
  return "unknown configuration error";
}

std::optional<BusConfigError> validate(const BusClockConfig& config) noexcept {
  // Written so that what is not a number fails too.
  const auto usable = [](double limit) { return limit > 0.0 && std::isfinite(limit); };
  if (config.cycle <= Nanoseconds{0}) return BusConfigError::kCycle;
  if (!(config.sync0_phase >= 0.0 && config.sync0_phase <= 1.0)) return BusConfigError::kSync0Phase;
  if (config.sample_interval < config.cycle) return BusConfigError::kSampleInterval;
  if (config.time_constant <= Nanoseconds{0}) return BusConfigError::kTimeConstant;
  if (!config.limits.valid()) return BusConfigError::kRateLimits;
  if (!usable(config.largest_pull_ppb)) return BusConfigError::kPull;
  if (!usable(config.largest_slope_ppb_per_s)) return BusConfigError::kSlope;
  if (config.missed_intervals_to_holdover == 0) return BusConfigError::kHoldover;
  if (!config.lock.band.valid()) return BusConfigError::kLock;
  return std::nullopt;
}

const char* name(BusClockState state) noexcept {
  switch (state) {
    case BusClockState::kWaiting:
      return "waiting";
    case BusClockState::kAcquiring:
      return "acquiring";
    case BusClockState::kLocked:
      return "locked";
    case BusClockState::kHoldover:
      return "holdover";
  }
  return "unknown";
}

BusClock::BusClock(const BusClockConfig& config) noexcept
    : config_(config),
      estimator_(estimator_config(config)),
      lock_(config.lock),
      cycles_per_sample_(cycles_per_sample(config)) {}

void BusClock::on_new_plant_time() noexcept {
  estimator_.reset();
  lock_.reset();
  used_ = 0;
  missed_ = 0;
  decision_.known = false;
  decision_.state = BusClockState::kWaiting;
}

const BusClockDecision& BusClock::update(const BusClockSample& sample) noexcept {
  carry_on();
  const bool seen = sample.usable || sample.has_dc;
  if (seen) crystal_ = crystal_of(sample);
  unseen_ = seen ? 0 : unseen_ + 1;
  if (sample.usable) collect(sample);
  if (++cycles_ >= cycles_per_sample_) {
    estimate();
    judge();
    cycles_ = 0;
    used_ = 0;
  }
  move();
  return decision_;
}

void BusClock::collect(const BusClockSample& sample) noexcept {
  if (used_ == 0) {
    first_ = sample;
    sum_crystal_ns_ = 0.0;
  }
  const std::uint32_t stride = cycles_per_sample_ / kMostKept + 1;
  if (used_ > 0 && (cycles_ % stride != 0 || used_ == kMostKept)) return;
  const double crystal_ns = (crystal_ - crystal_of(first_)).ns();
  const double plant_ns = (sample.plant - first_.plant).ns();
  sum_crystal_ns_ += crystal_ns;
  residuals_[used_++] = static_cast<float>(plant_ns - crystal_ns * (1.0 + tracking_));
}

/// L in this cycle, whose frame may have been lost: it has gone on by as many cycles of R.
FreeRunningTime BusClock::crystal_now() const noexcept {
  return crystal_ + Duration::from_ns(static_cast<double>(unseen_) * cycle_ns() / (1.0 + rate_));
}

/// The middle of the interval, on a line of the known rate through the median.
void BusClock::estimate() noexcept {
  missed_ = used_ == 0 ? missed_ + 1 : 0;
  if (used_ == 0) return;
  auto* const middle = residuals_.begin() + used_ / 2;
  std::nth_element(residuals_.begin(), middle, residuals_.begin() + used_);
  const double crystal_ns = sum_crystal_ns_ / static_cast<double>(used_);
  const double plant_ns = crystal_ns * (1.0 + tracking_) + static_cast<double>(*middle);
  const FreeRunningTime crystal = crystal_of(first_) + Duration::from_ns(crystal_ns);
  const ReferenceTime plant = first_.plant + Duration::from_ns(plant_ns);
  const Duration offset = Duration::from_ns(offset_ns_);
  const LocalTime shown = relabel<LocalTime>(crystal + offset);
  // The frame has just written the offset that was decided a cycle ago; SYNC0 is still to come.
  // The last sample may lie as far back as the interval is long, and the drift since with it.
  const ClockReading now{crystal_now(), relabel<LocalTime>(crystal_now() + offset)};
  static_cast<void>(estimator_.update({Direction::kForward, plant, shown, crystal}, now));
  const ServoSnapshot snapshot = estimator_.snapshot_at(now);
  if (!snapshot.offset_known) return;
  decision_.known = true;
  decision_.tracking = config_.limits.clamp(snapshot.rate_ratio);
  decision_.sigma_ns = snapshot.offset_sigma_ns;
  tracking_ = decision_.tracking.deviation();
  const Duration until_sync0 = Duration::from_ns(-tracking_ * config_.sync0_phase * cycle_ns());
  decision_.dc_to_plant = snapshot.offset + until_sync0;
  error_ns_ = decision_.dc_to_plant.ns();
}

void BusClock::judge() noexcept {
  if (!decision_.known) return;
  if (missed_ >= config_.missed_intervals_to_holdover) {
    decision_.state = BusClockState::kHoldover;
    // Since the last sample the crystal went on: only how far it can be trusted is asked.
    const Duration gone{config_.sample_interval * static_cast<std::int64_t>(missed_)};
    const FreeRunningTime crystal = crystal_ + gone;
    const LocalTime shown = relabel<LocalTime>(crystal + Duration::from_ns(offset_ns_));
    decision_.sigma_ns = estimator_.snapshot_at({crystal, shown}).offset_sigma_ns;
    return;
  }
  if (missed_ > 0) return;
  // Where nothing is moved there is nothing to be locked: known is all there is.
  const bool locked = lock_.update(Duration::from_ns(error_ns_)) || lock_.locked();
  decision_.state = locked || !config_.steer ? BusClockState::kLocked : BusClockState::kAcquiring;
}

double BusClock::pull() const noexcept {
  const double distance_s = std::abs(error_ns_) * 1e-9;
  const double time_s = static_cast<double>(config_.time_constant.count()) * 1e-9;
  const double slope = config_.largest_slope_ppb_per_s * kPpb;
  const double speed = std::min({distance_s / time_s, config_.largest_pull_ppb * kPpb,
                                 kBrakeReserve * std::sqrt(2.0 * slope * distance_s)});
  return error_ns_ > 0.0 ? -speed : speed;
}

/// From the last SYNC0 to the one behind this frame.
void BusClock::carry_on() noexcept {
  if (!decision_.known) return;
  const double moved_ns = (rate_ - tracking_) * cycle_ns();
  error_ns_ += moved_ns;
  decision_.dc_to_plant += Duration::from_ns(moved_ns);
}

/// One cycle: the rate goes towards its target, the offset with the rate.
void BusClock::move() noexcept {
  if (config_.steer && decision_.known) {
    // In holdover nothing is known to pull at.
    const double pulled = decision_.state == BusClockState::kHoldover ? 0.0 : pull();
    const double target =
        config_.limits.clamp(Rate::from_ratio(1.0 + tracking_ + pulled)).deviation();
    const double most = config_.largest_slope_ppb_per_s * kPpb * cycle_ns() * 1e-9;
    rate_ += std::clamp(target - rate_, -most, most);
    offset_ns_ += rate_ * cycle_ns();
  }
  decision_.rate_ppb = rate_ * 1e9;
  decision_.offset_ns = static_cast<std::int64_t>(std::floor(offset_ns_ + 0.5));
}

}  // namespace ftcs
