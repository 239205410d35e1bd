// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/dc_unit.h"

#include <algorithm>
#include <cmath>

namespace ftcs::ethercat {

namespace {
constexpr std::uint16_t kDefaultSpeedStart = 0x1000;
constexpr std::uint8_t kDefaultDifferenceFilter = 4;
constexpr std::uint8_t kDefaultSpeedFilter = 12;
constexpr std::uint16_t kMinSpeedStart = 0x0080;
constexpr std::uint16_t kMaxSpeedStart = 0x3FFF;
/// Deeper filters than 2^15 would not follow anything any more.
constexpr int kMaxFilterDepth = 15;
/// 0x092C holds 31 bits of magnitude.
constexpr double kMaxDifference = 2147483647.0;

std::uint16_t speed_start(const EscMemory& memory) noexcept {
  return std::clamp(memory.get<std::uint16_t>(reg::kSpeedCounterStart), kMinSpeedStart,
                    kMaxSpeedStart);
}

/// Deviation for a speed counter difference d, and the difference for a deviation.
double deviation_of(double start, double d) noexcept {
  return d / (5.0 * (start + d + 2.0) * (start - d + 2.0));
}
double difference_of(double start, double deviation) noexcept {
  // d = 5 y (a^2 - d^2) with a = start + 2: the smaller root of 5 y d^2 + d - 5 y a^2 = 0.
  const double a = start + 2.0;
  return 10.0 * deviation * a * a / (1.0 + std::sqrt(1.0 + 100.0 * deviation * deviation * a * a));
}
}  // namespace

void DcUnit::power_on(WireTime now) noexcept {
  memory_.set(reg::kSpeedCounterStart, kDefaultSpeedStart);
  memory_.set(reg::kSystemTimeDifferenceFilter, kDefaultDifferenceFilter);
  memory_.set(reg::kSpeedCounterFilter, kDefaultSpeedFilter);
  base_crystal_ = ticks(now);
  base_local_ = config_.initial_local;
  rate_ = Rate{};
  armed_ = false;
  reset_loop();
}

Duration DcUnit::ticks(WireTime instant) const noexcept {
  const std::int64_t whole = oscillator_.reading(instant).floor_ns();
  return Duration::from_whole_ns(whole - whole % config_.tick.count());
}

Duration DcUnit::local_time(WireTime instant) const noexcept {
  return base_local_ + scale(ticks(instant) - base_crystal_, rate_);
}

std::uint64_t DcUnit::system_time(WireTime instant) const noexcept {
  return static_cast<std::uint64_t>(local_time(instant).floor_ns()) + offset();
}

void DcUnit::refresh(WireTime sof) noexcept {
  const auto delay = memory_.get<std::uint32_t>(reg::kSystemTimeDelay);
  memory_.set(reg::kSystemTime, system_time(sof) - delay);
  if (armed_) memory_.set(reg::kSync0StartTime, next_sync0_);
  memory_.set(reg::kSync1StartTime, next_sync1(sof));
}

void DcUnit::latch_arrival(WireTime sof) noexcept {
  const auto local = static_cast<std::uint64_t>(local_time(sof).floor_ns());
  memory_.set(reg::kReceiveTimeProcessingUnit, local);
  memory_.set(reg::kReceiveTimePort0, static_cast<std::uint32_t>(local));
}

void DcUnit::latch_return(unsigned port, WireTime sof) noexcept {
  memory_.set(reg::kReceiveTimePort0 + port * sizeof(std::uint32_t),
              static_cast<std::uint32_t>(local_time(sof).floor_ns()));
}

std::int64_t DcUnit::error_against(std::uint64_t own, ConstBytes received) const noexcept {
  if (received.size() >= sizeof(std::uint64_t)) {
    return static_cast<std::int64_t>(own - load<std::uint64_t>(received, 0));
  }
  const auto low = static_cast<std::uint32_t>(own) - load<std::uint32_t>(received, 0);
  return static_cast<std::int32_t>(low);
}

void DcUnit::synchronise(WireTime sof, ConstBytes received) noexcept {
  const auto delay = memory_.get<std::uint32_t>(reg::kSystemTimeDelay);
  const std::int64_t error = error_against(system_time(sof) - delay, received);
  const Duration crystal = ticks(sof);
  const Duration since_last = crystal - last_sample_;
  const bool first = samples_ == 0;
  filter(std::clamp(static_cast<double>(error), -kMaxDifference, kMaxDifference));
  last_sample_ = crystal;
  // The first sample after a reset has no interval; two in one tick have none either.
  if (!first && since_last > Duration{}) steer(since_last);
}

void DcUnit::filter(double error_ns) noexcept {
  const int depth =
      std::min<int>(memory_.get<std::uint8_t>(reg::kSystemTimeDifferenceFilter), kMaxFilterDepth);
  const std::uint32_t window = 1U << depth;
  // A growing mean until the window is full: the first samples count at once.
  samples_ = std::min(samples_ + 1, window);
  mean_error_ns_ += (error_ns - mean_error_ns_) / static_cast<double>(samples_);
  const double magnitude = std::min(std::abs(mean_error_ns_), kMaxDifference);
  const bool ahead = mean_error_ns_ >= 0.0;
  const std::uint32_t sign = ahead == config_.sign_bit_means_ahead ? 0x80000000U : 0U;
  const auto rounded = static_cast<std::uint32_t>(magnitude + 0.5);
  memory_.set(reg::kSystemTimeDifference, rounded == 0 ? 0U : rounded | sign);
}

void DcUnit::steer(Duration since_last) noexcept {
  const double start = speed_start(memory_);
  const int depth =
      std::min<int>(memory_.get<std::uint8_t>(reg::kSpeedCounterFilter), kMaxFilterDepth);
  // Critically damped: natural frequency 2^(-depth/2) per frame, twice that as proportional gain.
  const double bandwidth = kDefaultSpeedStart / start;
  const double natural = std::exp2(-0.5 * depth) * bandwidth;
  const double relative = mean_error_ns_ / since_last.ns();
  constexpr double kReserve = 0x7F;  // d reaches ±(s - 0x7F)
  const double limit = deviation_of(start, start - kReserve);
  integral_ = std::clamp(integral_ - natural * natural * relative, -limit, limit);
  const double wanted = std::clamp(integral_ - 2.0 * natural * relative, -limit, limit);
  const double difference = std::round(difference_of(start, wanted));
  memory_.set(reg::kSpeedCounterDifference,
              static_cast<std::uint16_t>(static_cast<std::int16_t>(difference)));
  set_speed(last_sample_, deviation_of(start, difference));
}

void DcUnit::set_speed(Duration crystal, double deviation) noexcept {
  base_local_ = base_local_ + scale(crystal - base_crystal_, rate_);
  base_crystal_ = crystal;
  rate_ = Rate::from_ratio(1.0 + deviation);
}

void DcUnit::reset_loop() noexcept {
  mean_error_ns_ = 0.0;
  integral_ = 0.0;
  samples_ = 0;
  memory_.set(reg::kSystemTimeDifference, std::uint32_t{0});
  memory_.set(reg::kSpeedCounterDifference, std::uint16_t{0});
  if (rate_ != Rate{}) set_speed(std::max(last_sample_, base_crystal_), 0.0);
}

void DcUnit::activate(WireTime now) noexcept {
  const auto activation = memory_.get<std::uint8_t>(reg::kDcActivation);
  constexpr std::uint8_t kBoth = reg::kActivateCyclic | reg::kActivateSync0;
  if ((activation & kBoth) != kBoth) {
    armed_ = false;
  } else if (!armed_) {
    first_sync0_ = next_sync0_ = memory_.get<std::uint64_t>(reg::kSync0StartTime);
    // A start in the past never fires: the comparator waits for equality.
    armed_ = static_cast<std::int64_t>(next_sync0_ - system_time(now)) > 0;
  }
  memory_.set(reg::kActivationStatus, static_cast<std::uint8_t>(armed_ ? 1 : 0));
}

std::uint64_t DcUnit::next_sync1(WireTime now) const noexcept {
  const auto activation = memory_.get<std::uint8_t>(reg::kDcActivation);
  const std::uint64_t cycle = memory_.get<std::uint32_t>(reg::kSync0CycleTime);
  if (!armed_ || cycle == 0 || (activation & reg::kActivateSync1) == 0) return 0;
  const std::uint64_t behind = memory_.get<std::uint32_t>(reg::kSync1CycleTime);
  const std::uint64_t period = (behind / cycle + 1) * cycle;
  const std::uint64_t first = first_sync0_ + behind;
  const std::uint64_t shown = system_time(now);
  return shown < first ? first : first + ((shown - first) / period + 1) * period;
}

bool DcUnit::take_sync0(WireTime now, Sync0Event& event) noexcept {
  if (!armed_ || static_cast<std::int64_t>(next_sync0_ - system_time(now)) > 0) return false;
  const auto local = static_cast<std::int64_t>(next_sync0_ - offset());
  event.system_time = next_sync0_;
  event.oscillator =
      base_crystal_ + scale(Duration::from_whole_ns(local) - base_local_, rate_.inverse());
  const auto cycle = memory_.get<std::uint32_t>(reg::kSync0CycleTime);
  next_sync0_ += cycle;
  if (cycle == 0) armed_ = false;  // single shot
  return true;
}

void DcUnit::skip_sync0(WireTime now) noexcept {
  const auto cycle = memory_.get<std::uint32_t>(reg::kSync0CycleTime);
  const auto behind = static_cast<std::int64_t>(system_time(now) - next_sync0_);
  if (!armed_ || cycle == 0 || behind < 0) return;
  next_sync0_ += (static_cast<std::uint64_t>(behind) / cycle + 1) * cycle;
}

}  // namespace ftcs::ethercat
