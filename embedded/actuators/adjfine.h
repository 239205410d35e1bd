/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ACTUATOR_ADJFINE_H
#define FTCS_ACTUATOR_ADJFINE_H

/* Interfaces that take a deviation: Linux' and NuttX' adjfine (2^-16 parts per million, 0.015 ppb)
 * and the wish of Zephyr's ptp_clock_rate_adjust (a ratio to nominal, double). */

#include <stdint.h>

/* (addend / nominal - 1) 10^6 2^16, rounded to nearest; nominal not zero, addend at most a thousand
 * times nominal. */
static inline int64_t ftcs_adjfine_scaled_ppm(uint32_t addend, uint32_t nominal_addend) {
  const int64_t deviation = (int64_t)addend - (int64_t)nominal_addend;
  const int64_t size = deviation < 0 ? -deviation : deviation;
  const int64_t nominal = (int64_t)nominal_addend;
  /* 10^6 2^16 is beyond 32 bits: in two steps, so that nothing overflows. */
  const int64_t ppm = size * 1000000 / nominal;
  const int64_t rest = size * 1000000 % nominal;
  const int64_t scaled = ppm * 65536 + (rest * 65536 + nominal / 2) / nominal;
  return deviation < 0 ? -scaled : scaled;
}

/* The ratio that is meant by the addend, for an interface in double. The only floating point beside
 * the servo: two conversions and a division outside of it. */
static inline double ftcs_rate_ratio(uint32_t addend, uint32_t nominal_addend) {
  return (double)addend / (double)nominal_addend;
}

#endif
