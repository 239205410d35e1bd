// SPDX-License-Identifier: MIT
#include "ftcs/discipline/ftcs_bus_clock.h"

#include <new>
#include <type_traits>

#include "ftcs/discipline/bus_clock.h"

namespace {

using ftcs::BusClock;

static_assert(std::is_trivially_copyable_v<BusClock>);
static_assert(sizeof(BusClock) <= sizeof(ftcs_bus_clock));
static_assert(alignof(BusClock) <= alignof(ftcs_bus_clock));

BusClock& clock_in(ftcs_bus_clock& storage) noexcept {
  return *std::launder(static_cast<BusClock*>(static_cast<void*>(storage.words)));
}

constexpr int64_t kHour = 3'600'000'000'000;
bool is_time(int64_t ns) noexcept { return ns > 0 && ns <= kHour; }
bool is_limit(double ppm) noexcept { return ppm > 0.0 && ppm < 1e5; }

ftcs::BusClockConfig from_c(const ftcs_bus_config& config) noexcept {
  ftcs::BusClockConfig result;
  result.steer = config.steer != 0;
  result.cycle = ftcs::Nanoseconds{config.cycle_ns};
  result.sample_interval = ftcs::Nanoseconds{config.sample_interval_ns};
  result.time_constant = ftcs::Nanoseconds{config.time_constant_ns};
  result.sync0_phase = config.sync0_phase;
  result.limits = ftcs::RateLimits::symmetric_ppb(1e3 * config.limit_ppm);
  result.largest_pull_ppb = 1e3 * config.pull_ppm;
  result.largest_slope_ppb_per_s = 1e3 * config.slope_ppm_per_s;
  return result;
}

/// Narrower than what validate() takes: of figures that somebody wrote into a file.
int32_t check(const ftcs_bus_config& config) noexcept {
  if (!is_time(config.cycle_ns) || !is_time(config.sample_interval_ns) ||
      !is_time(config.time_constant_ns) || config.sample_interval_ns < config.cycle_ns) {
    return FTCS_BUS_BAD_TIME;
  }
  const bool limits =
      is_limit(config.limit_ppm) && is_limit(config.pull_ppm) && is_limit(config.slope_ppm_per_s);
  return limits && !validate(from_c(config)) ? FTCS_BUS_OK : FTCS_BUS_BAD_LIMIT;
}

}  // namespace

extern "C" {

ftcs_bus_config ftcs_bus_default_config(int64_t cycle_ns) {
  const ftcs::BusClockConfig defaults;
  ftcs_bus_config config{};
  config.cycle_ns = cycle_ns;
  config.sample_interval_ns = defaults.sample_interval.count();
  config.time_constant_ns = defaults.time_constant.count();
  config.sync0_phase = defaults.sync0_phase;
  config.limit_ppm = defaults.limits.fastest.ppm();
  config.pull_ppm = 1e-3 * defaults.largest_pull_ppb;
  config.slope_ppm_per_s = 1e-3 * defaults.largest_slope_ppb_per_s;
  config.steer = 1;
  return config;
}

int32_t ftcs_bus_init(ftcs_bus_clock* clock, size_t storage_size, const ftcs_bus_config* config) {
  if (storage_size != sizeof(ftcs_bus_clock)) return FTCS_BUS_BAD_STORAGE;
  const int32_t error = check(*config);
  if (error == FTCS_BUS_OK) new (clock->words) BusClock(from_c(*config));
  return error;
}

ftcs_bus_decision ftcs_bus_update(ftcs_bus_clock* clock, const ftcs_bus_sample* sample) {
  ftcs::BusClockSample given;
  constexpr int32_t kAllButPlant = 2;
  given.has_dc = sample->usable != 0;
  given.usable = given.has_dc && sample->usable != kAllButPlant;
  given.dc = ftcs::LocalTime::from_ns(sample->dc_ns);
  given.plant = ftcs::ReferenceTime::from_ns(sample->plant_ns);
  given.offset_ns = sample->offset_ns;
  const ftcs::BusClockDecision& decision = clock_in(*clock).update(given);
  ftcs_bus_decision result{};
  result.offset_ns = decision.offset_ns;
  result.dc_to_plant_ns = decision.known ? decision.dc_to_plant.rounded_ns() : 0;
  result.sigma_ns = decision.sigma_ns;
  result.rate_ppb = decision.rate_ppb;
  result.state = static_cast<int32_t>(decision.state);
  result.known = decision.known ? 1 : 0;
  return result;
}

void ftcs_bus_new_plant_time(ftcs_bus_clock* clock) { clock_in(*clock).on_new_plant_time(); }

}  // extern "C"
