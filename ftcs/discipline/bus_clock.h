// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "ftcs/discipline/lock_detector.h"
#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/in_order.h"

namespace ftcs {

/// Of a bus that follows plant time. Valid: validate() finds nothing.
struct BusClockConfig {
  /// False: the offset is told and nothing is moved.
  bool steer = true;
  Nanoseconds cycle{1'000'000};  ///< above zero
  double sync0_phase = 0.5;      ///< SYNC0 comes this part of a cycle after the frame; 0 to 1
  /// Of the samples of so long a time the estimator hears the middle one; >= cycle.
  Nanoseconds sample_interval{125'000'000};
  /// An offset is removed with this time constant, where no limit binds; several sample intervals.
  Nanoseconds time_constant{500'000'000};
  /// Of the bus against the crystal of the reference clock: the crystal's own deviation and what is
  /// pulled beside it. Drives fault at some 600 ppm (docs/ethercat.md).
  RateLimits limits = RateLimits::symmetric_ppb(4e5);
  double largest_pull_ppb = 5e4;         ///< beside the rate that tracks
  double largest_slope_ppb_per_s = 1e5;  ///< of any change of the rate
  /// Sample intervals without a sample before it is holdover.
  std::uint32_t missed_intervals_to_holdover = 8;
  LockConfig lock{{Nanoseconds{500}, Nanoseconds{2'000}}, 8};
};

/// Why a BusClockConfig cannot work.
enum class BusConfigError : std::uint8_t {
  kCycle,
  kSync0Phase,
  kSampleInterval,
  kTimeConstant,
  kRateLimits,
  kPull,
  kSlope,
  kHoldover,
  kLock,
};
/// One sentence: what was expected.
[[nodiscard]] std::string_view describe(BusConfigError error) noexcept;
/// The first thing that is wrong, in the order of the enumeration. A figure that is not a number
/// is.
[[nodiscard]] std::optional<BusConfigError> validate(const BusClockConfig& config) noexcept;

/// One cycle: what the reference clock of the bus and plant time showed at one instant.
struct BusClockSample {
  bool usable = false;     ///< both are known and nothing speaks against them
  bool has_dc = false;     ///< dc is known, whether plant time is or not
  LocalTime dc;            ///< system time of the reference clock, latched by the frame
  ReferenceTime plant;     ///< plant time at the same instant
  std::int64_t offset_ns;  ///< what had been added to the system time offset when it was latched
};

/// How the bus stands to plant time.
enum class BusClockState : std::uint8_t {
  kWaiting,    ///< no plant time yet
  kAcquiring,  ///< known, not yet within the band
  kLocked,
  kHoldover,  ///< plant time stays away: the last rate is kept
};
[[nodiscard]] const char* name(BusClockState state) noexcept;

/// What holds for the next frame. Until `known`, dc_to_plant and tracking mean nothing.
struct BusClockDecision {
  BusClockState state = BusClockState::kWaiting;
  bool known = false;  ///< dc_to_plant means something
  /// System time minus plant time at SYNC0, filtered: positive, the bus is ahead.
  Duration dc_to_plant{};
  double sigma_ns = 0.0;  ///< honest standard deviation of it; grows in holdover
  /// Rate of the bus that would be plant time's, per crystal of the reference clock.
  Rate tracking;
  double rate_ppb = 0.0;  ///< what the bus is bent by at present, per its crystal
  /// To be added to 0x0920 of the reference clock, in total since the start, by the next frame.
  std::int64_t offset_ns = 0;
};

/// Plant time for an EtherCAT segment: tells how far the distributed clock is from plant time, and
/// lets it follow slowly ("external synchronisation", DCX) or at the pace of the host ("bus
/// shift").
///
/// The system time of the reference clock is R = L + offset, L the clock's own crystal, offset the
/// register 0x0920. A written 0x0910 would carry the lateness of the frame that carries it; an
/// increment of 0x0920 is a difference, and a difference has no lateness: each cycle a few
/// nanoseconds are added, so that R runs at a commanded rate per L (decision 0017). L is known
/// exactly, because the offset is our own; the adaptive servo's estimator hears (plant, L) and
/// tells offset e, rate and deviation without being moved by what is steered.
///
///   target rate of R per L   = tracking - 1 + pull
///   pull                     = -sign(e) min(|e| / T, pull_max, 0.7 sqrt(2 s |e|))
///   rate                    -> target, by at most s = largest_slope per second
///
/// One stamp of a busy host in two hundred is tens of microseconds off: of the cycles of a sample
/// interval the median is taken, against a line of the rate that is known.
///
/// Between two frames R runs with L and not with plant time: a saw tooth of 100 ns at 100 ppm and
/// 1 ms. e is what it is at SYNC0, the instant that drives act on.
///
/// The root is the speed from which the slope still brakes to a stand: no overshoot. A value;
/// nothing waits, nothing allocates. No jump after the start, whatever plant time does. With the
/// defaults 1 ms of offset takes some twenty seconds at 50 ppm; put the bus right before SYNC0
/// starts (0x0920 of all SubDevices).
class BusClock {
 public:
  /// Valid: validate(config) finds nothing; it is not asked here.
  explicit BusClock(const BusClockConfig& config) noexcept;

  /// Once in each cycle, usable or not. The decision holds for the next frame. At the end of a
  /// sample interval it costs a median of at most 256 values and an update of the estimator.
  const BusClockDecision& update(const BusClockSample& sample) noexcept;
  /// Plant time comes from somewhere else, or the bus was put elsewhere: what is known is void; the
  /// rate is kept.
  void on_new_plant_time() noexcept;
  [[nodiscard]] const BusClockDecision& decision() const noexcept { return decision_; }

 private:
  void carry_on() noexcept;
  void collect(const BusClockSample& sample) noexcept;
  [[nodiscard]] FreeRunningTime crystal_now() const noexcept;
  void estimate() noexcept;
  void judge() noexcept;
  void move() noexcept;
  [[nodiscard]] double pull() const noexcept;
  [[nodiscard]] double cycle_ns() const noexcept {
    return static_cast<double>(config_.cycle.count());
  }

  BusClockConfig config_;
  InOrder<AdaptiveServo> estimator_;
  LockDetector lock_;
  BusClockDecision decision_;
  std::uint32_t cycles_per_sample_;
  std::uint32_t cycles_ = 0;  ///< of the sample under way
  std::uint32_t used_ = 0;    ///< of them kept
  BusClockSample first_;      ///< usable one of the sample under way
  double sum_crystal_ns_ = 0.0;
  static constexpr std::uint32_t kMostKept = 256;
  std::array<float, kMostKept> residuals_{};  ///< ns, against a line of the known rate
  ReferenceTime last_plant_;
  std::uint32_t missed_ = 0;  ///< sample intervals without a sample
  double error_ns_ = 0.0;     ///< e, carried on between samples
  double tracking_ = 0.0;     ///< deviation of the rate that tracks
  double rate_ = 0.0;         ///< deviation that is commanded
  double offset_ns_ = 0.0;    ///< integral of it
  FreeRunningTime crystal_;   ///< L, when it was last seen
  std::uint32_t unseen_ = 0;  ///< cycles since then
};

}  // namespace ftcs
