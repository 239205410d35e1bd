// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/clock/steering_history.h"

namespace ftcs {

/// The registers of a clock that stamps with what is steered: the time stamping unit of an Ethernet
/// MAC. An implementation is a few lines (examples/embedded).
///
/// The unit adds the addend to an accumulator of 32 bits at each tick and moves its time on when
/// that overflows (paper Fig. 2): rate = addend / nominal addend. No function may fail, and none
/// may call back into the RegisterClock.
class AddendRegister {
 public:
  /// What the clock shows.
  [[nodiscard]] virtual LocalTime now() noexcept = 0;
  /// The clock runs at addend / nominal addend from here on.
  virtual void write(std::uint32_t addend) noexcept = 0;
  /// Adds to what the clock shows, in either direction: the coarse update of the unit.
  virtual void step(Duration by) noexcept = 0;
  /// RegisterClock::on_alarm() is to be called when the clock shows `at`; replaces an earlier one.
  virtual void alarm(LocalTime at) noexcept = 0;

 protected:
  AddendRegister() = default;
  AddendRegister(const AddendRegister&) = default;
  AddendRegister& operator=(const AddendRegister&) = default;
  ~AddendRegister() = default;
};

/// What the unit is set up with before a RegisterClock takes it over.
struct RegisterClockConfig {
  std::uint32_t nominal_addend = 0;  ///< of rate 1; what remains of a fraction is the oscillator's
  std::uint32_t addend = 0;          ///< that the register holds
  RateLimits limits;                 ///< narrowed to what 32 bits can express
};

/// A clock with an addend register as an AdjustableClock, for every servo of the core.
///
/// The hardware has the steered face only: the free-running one is rebuilt by taking back what was
/// written (SteeringHistory), in the addends' own rates, so that rounding is no error. It begins
/// with what the clock shows and runs at what nominal_addend would make. A correction is ended by
/// on_alarm(), or by the first read() after it: lateness is accounted for. One thread; where
/// on_alarm() is an interrupt, it is held off while another function runs.
///
/// A rate is rounded to the nearest addend, 1 / nominal_addend apart (0.23 ppb and more with 32
/// bits); tell the adaptive servo by SteeringLimits::rate_granularity.
class RegisterClock final : public AdjustableClock, public FreeRunningSource {
 public:
  /// The registers must outlive the clock; both addends above zero, unchecked.
  RegisterClock(AddendRegister& registers, const RegisterClockConfig& config) noexcept;

  [[nodiscard]] ClockReading read() noexcept override;
  [[nodiscard]] LocalTime local_at(FreeRunningTime instant) const noexcept override {
    return history_.local_at(instant);
  }
  [[nodiscard]] RateLimits rate_limits() const noexcept override { return limits_; }
  [[nodiscard]] Result<ClockReading, ClockError> apply(
      const ServoCommand& command) noexcept override;
  [[nodiscard]] FreeRunningTime now() noexcept override { return read().free_running; }

  /// A stamp of the hardware on the free-running face, within the last eight commands.
  [[nodiscard]] FreeRunningTime from_stamp(LocalTime stamp) const noexcept {
    return history_.free_running_at(stamp);
  }
  /// The correction is over: the tracking addend is written. Too late is accounted for; too early
  /// does nothing, and the next read() or alarm ends the correction.
  void on_alarm() noexcept { static_cast<void>(read()); }
  /// What the register holds at present.
  [[nodiscard]] std::uint32_t addend() const noexcept { return addend_; }

 private:
  [[nodiscard]] std::uint32_t addend_for(Rate rate) const noexcept;
  [[nodiscard]] Rate rate_of(std::uint32_t addend) const noexcept;
  [[nodiscard]] ClockReading reading() noexcept;
  void write(const ClockReading& at, std::uint32_t addend, Duration step = {}) noexcept;

  AddendRegister& registers_;
  double nominal_;
  RateLimits limits_;
  std::uint32_t addend_;
  std::uint32_t next_addend_;
  std::optional<LocalTime> end_{};  // of the correction that is under way
  SteeringHistory history_;
};

}  // namespace ftcs
