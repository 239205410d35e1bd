// SPDX-License-Identifier: MIT
#include "ftcs/discipline/ftcs_cycle_servo.h"

#include <cstring>
#include <new>
#include <type_traits>

#include "ftcs/discipline/cycle_servo_impl.h"

namespace {

#ifdef FTCS_CYCLE_WITHOUT_ADAPTIVE
using Servo = ftcs::BasicCycleServo<ftcs::NoAdaptiveServo>;
constexpr bool kHasAdaptive = false;
#else
using Servo = ftcs::CycleServo;
constexpr bool kHasAdaptive = true;
#endif

static_assert(std::is_trivially_copyable_v<Servo>);
static_assert(sizeof(Servo) <= sizeof(ftcs_cycle_servo));
static_assert(alignof(Servo) <= alignof(ftcs_cycle_servo));

Servo& servo_in(ftcs_cycle_servo& storage) noexcept {
  return *std::launder(static_cast<Servo*>(static_cast<void*>(storage.words)));
}

ftcs_cycle_decision to_c(const ftcs::CycleDecision& decision) noexcept {
  ftcs_cycle_decision result{};
  result.wake_ns = decision.wake.since_epoch().rounded_ns();
  result.phase_error_ns = decision.phase_error.rounded_ns();
  result.lateness_ns = decision.lateness.rounded_ns();
  result.rate_ppb = decision.rate.ppb();
  result.skipped = decision.skipped;
  result.state = static_cast<int32_t>(decision.state);
  result.verdict = static_cast<int32_t>(decision.verdict);
  result.commanded = decision.commanded ? 1 : 0;
  return result;
}

bool is_gain(double gain) noexcept { return gain >= 0.0 && gain < 1e9; }

constexpr int64_t kHour = 3'600'000'000'000;
bool within_hour(int64_t ns) noexcept { return ns >= -kHour && ns <= kHour; }

int32_t check(const ftcs_cycle_config& config) noexcept {
  const int32_t last = kHasAdaptive ? FTCS_CYCLE_ADAPTIVE : FTCS_CYCLE_PICS;
  if (config.law < FTCS_CYCLE_NONE || config.law > last) return FTCS_CYCLE_BAD_LAW;
  if (config.cycle_ns <= 0 || config.resolution_ns <= 0 || config.cycles_per_sync == 0) {
    return FTCS_CYCLE_BAD_CYCLE;
  }
  if (!within_hour(config.cycle_ns) || !within_hour(config.resolution_ns) ||
      config.cycles_per_sync > kHour / config.cycle_ns) {
    return FTCS_CYCLE_BAD_CYCLE;
  }
  if (!is_gain(config.proportional_gain) || !is_gain(config.integral_gain) ||
      !is_gain(config.offset_gain) || config.offset_gain > 1.0) {
    return FTCS_CYCLE_BAD_GAIN;
  }
  constexpr double kMostPpm = 500000.0;
  if (!(config.limit_ppm > 0.0 && config.limit_ppm < kMostPpm)) return FTCS_CYCLE_BAD_LIMIT;
  const bool bounds = config.band_ns >= 0 && config.largest_lateness_ns >= 0 &&
                      config.largest_round_trip_ns >= 0 && config.lock_enter_ns >= 0 &&
                      config.lock_leave_ns >= config.lock_enter_ns &&
                      within_hour(config.shift_ns) && within_hour(config.transit_ns);
  return bounds ? FTCS_CYCLE_OK : FTCS_CYCLE_BAD_LIMIT;
}

ftcs::CycleServoConfig from_c(const ftcs_cycle_config& config) noexcept {
  ftcs::CycleServoConfig result;
  result.law = static_cast<ftcs::CycleLaw>(config.law);
  result.cycle = ftcs::Nanoseconds{config.cycle_ns};
  result.shift = ftcs::Nanoseconds{config.shift_ns};
  result.resolution = ftcs::Nanoseconds{config.resolution_ns};
  result.cycles_per_sync = config.cycles_per_sync;
  result.offset_gain = config.offset_gain;
  result.band = {ftcs::Nanoseconds{config.band_ns}, ftcs::Nanoseconds{config.band_ns}};
  result.proportional_gain = config.proportional_gain;
  result.integral_gain = config.integral_gain;
  constexpr double kPpbPerPpm = 1000.0;
  result.limits = ftcs::RateLimits::symmetric_ppb(config.limit_ppm * kPpbPerPpm);
  result.transit = ftcs::Nanoseconds{config.transit_ns};
  result.largest_lateness = ftcs::Nanoseconds{config.largest_lateness_ns};
  result.largest_round_trip = ftcs::Nanoseconds{config.largest_round_trip_ns};
  result.lock = {{ftcs::Nanoseconds{config.lock_enter_ns}, ftcs::Nanoseconds{config.lock_leave_ns}},
                 config.lock_cycles};
  result.coast_limit = config.coast_limit;
  result.align_at_start = config.align_at_start != 0;
  return result;
}

}  // namespace

ftcs_cycle_config ftcs_cycle_default_config(void) {
  const ftcs::CycleServoConfig defaults;
  constexpr double kPartsPerMillion = 1e6;
  ftcs_cycle_config config{};
  config.law = FTCS_CYCLE_FTCS;
  config.align_at_start = defaults.align_at_start ? 1 : 0;
  config.cycle_ns = defaults.cycle.count();
  config.shift_ns = defaults.shift.count();
  config.resolution_ns = defaults.resolution.count();
  config.cycles_per_sync = defaults.cycles_per_sync;
  config.lock_cycles = defaults.lock.dwell;
  config.offset_gain = defaults.offset_gain;
  config.band_ns = defaults.band.enter.floor_ns();
  config.proportional_gain = defaults.proportional_gain;
  config.integral_gain = defaults.integral_gain;
  config.limit_ppm = defaults.limits.fastest.deviation() * kPartsPerMillion;
  config.transit_ns = defaults.transit.count();
  config.largest_lateness_ns = defaults.largest_lateness.count();
  config.largest_round_trip_ns = defaults.largest_round_trip.count();
  config.lock_enter_ns = defaults.lock.band.enter.floor_ns();
  config.lock_leave_ns = defaults.lock.band.leave.floor_ns();
  config.coast_limit = defaults.coast_limit;
  return config;
}

int32_t ftcs_cycle_init(ftcs_cycle_servo* servo, size_t servo_size,
                        const ftcs_cycle_config* config) {
  if (servo_size != sizeof(ftcs_cycle_servo)) return FTCS_CYCLE_BAD_STORAGE;
  const int32_t error = check(*config);
  if (error != FTCS_CYCLE_OK) return error;
  std::memset(servo, 0, sizeof *servo);
  new (servo->words) Servo{from_c(*config)};
  return FTCS_CYCLE_OK;
}

ftcs_cycle_decision ftcs_cycle_start(ftcs_cycle_servo* servo, int64_t now_ns) {
  return to_c(servo_in(*servo).start(ftcs::FreeRunningTime::from_ns(now_ns)));
}

ftcs_cycle_decision ftcs_cycle_update(ftcs_cycle_servo* servo, const ftcs_cycle_sample* sample,
                                      int64_t now_ns) {
  ftcs::CycleSample input;
  input.has_reference = sample->has_reference != 0;
  input.reference = ftcs::ReferenceTime::from_ns(sample->reference_ns);
  input.sent = ftcs::FreeRunningTime::from_ns(sample->sent_ns);
  input.has_received = sample->has_received != 0;
  input.received = ftcs::FreeRunningTime::from_ns(sample->received_ns);
  input.has_scheduled = sample->has_scheduled != 0;
  input.scheduled = ftcs::FreeRunningTime::from_ns(sample->scheduled_ns);
  return to_c(servo_in(*servo).update(input, ftcs::FreeRunningTime::from_ns(now_ns)));
}

int64_t ftcs_cycle_unwrap(int64_t previous_ns, uint32_t low) {
  const auto previous = static_cast<uint64_t>(previous_ns);
  const auto step = static_cast<int32_t>(low - static_cast<uint32_t>(previous));
  return static_cast<int64_t>(previous + static_cast<uint64_t>(static_cast<int64_t>(step)));
}

const char* ftcs_cycle_state_name(int32_t state) {
  switch (state) {
    case FTCS_CYCLE_WAITING:
      return "waiting";
    case FTCS_CYCLE_ACQUIRING:
      return "acquiring";
    case FTCS_CYCLE_LOCKED:
      return "locked";
    case FTCS_CYCLE_COASTING:
      return "coasting";
    default:
      return "unknown";
  }
}
