// SPDX-License-Identifier: MIT
#include "ftcs/clock/register_clock.h"

#include <cmath>

#include "ftcs/clock/command_check.h"
#include "ftcs/time/relabel.h"

namespace ftcs {
namespace {

constexpr double kLargestAddend = 4294967295.0;

SteeringHistory beginning_at(LocalTime local, Rate rate) noexcept {
  return SteeringHistory{{relabel<FreeRunningTime>(local), local, rate}};
}

}  // namespace

RegisterClock::RegisterClock(AddendRegister& registers, const RegisterClockConfig& config) noexcept
    : registers_(registers),
      nominal_(config.nominal_addend),
      limits_(intersect(config.limits, {Rate::from_ratio(1.0 / nominal_),
                                        Rate::from_ratio(kLargestAddend / nominal_)})),
      addend_(config.addend),
      next_addend_(config.addend),
      history_(beginning_at(registers.now(), rate_of(config.addend))) {}

std::uint32_t RegisterClock::addend_for(Rate rate) const noexcept {
  return static_cast<std::uint32_t>(std::floor(limits_.clamp(rate).ratio() * nominal_ + 0.5));
}

Rate RegisterClock::rate_of(std::uint32_t addend) const noexcept {
  return Rate::from_ratio(addend / nominal_);
}

ClockReading RegisterClock::reading() noexcept {
  const LocalTime local = registers_.now();
  return {history_.free_running_at(local), local};
}

void RegisterClock::write(const ClockReading& at, std::uint32_t addend, Duration step) noexcept {
  registers_.write(addend);
  addend_ = addend;
  history_.steer(at.free_running, rate_of(addend), step);
}

ClockReading RegisterClock::read() noexcept {
  const ClockReading now = reading();
  if (end_ && now.local - *end_ >= Duration{}) {
    end_.reset();
    write(now, next_addend_);
  }
  return now;
}

Result<ClockReading, ClockError> RegisterClock::apply(const ServoCommand& command) noexcept {
  if (const auto error = find_error(command, limits_)) return *error;
  end_.reset();
  const ClockReading before = reading();
  if (command.step != Duration{}) registers_.step(command.step);
  next_addend_ = addend_for(command.tracking_rate);
  const bool corrects = has_correction(command);
  write(before, corrects ? addend_for(command.correction_rate) : next_addend_, command.step);
  if (corrects) {
    end_ = history_.local_at(before.free_running + correction_length(command));
    registers_.alarm(*end_);
  }
  return ClockReading{before.free_running, before.local + command.step};
}

}  // namespace ftcs
