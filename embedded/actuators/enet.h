/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ACTUATOR_ENET_H
#define FTCS_ACTUATOR_ENET_H

/* NXP ENET (i.MX RT, Kinetis): no addend. The time moves on by INC ns each tick, and by INC_CORR
 * instead once in ATCOR ticks, so that the rate is 1 + (INC_CORR - INC) / (INC ATCOR): steps that
 * grow with the square of the deviation if INC_CORR is left at INC +- 1, and are some INC times
 * finer with the best pair. The rate that came out must go back: ftcs_addend_wrote(). */

#include <stdint.h>

typedef struct ftcs_enet_rate {
  uint32_t increment_correction; /* ATINC.INC_CORR, 0 to 127 */
  uint32_t period;               /* ATCOR, 2 to 2^31 - 1; zero: no correction */
  uint32_t addend;               /* what was realised, in units of nominal_addend */
} ftcs_enet_rate;

/* The best pair for addend / nominal_addend, both not zero; increment_ns = 10^9 / input clock, 1
 * to 63. */
static inline ftcs_enet_rate ftcs_enet_best(uint32_t addend, uint32_t nominal_addend,
                                            uint32_t increment_ns) {
  ftcs_enet_rate best = {increment_ns, 0, nominal_addend};
  const int faster = addend > nominal_addend;
  const uint64_t deviation = faster != 0 ? addend - nominal_addend : nominal_addend - addend;
  const uint32_t most = faster != 0 ? 127U - increment_ns : increment_ns;
  uint64_t least_error = deviation;
  uint32_t d;
  for (d = 1; d <= most && deviation != 0U; ++d) {
    const uint64_t dividend = (uint64_t)d * nominal_addend;
    const uint64_t period = (dividend + increment_ns * deviation / 2U) / (increment_ns * deviation);
    uint64_t realised;
    uint64_t error;
    if (period < 2U || period > 0x7FFFFFFFU) continue;
    realised = (dividend + increment_ns * period / 2U) / (increment_ns * period);
    error = realised > deviation ? realised - deviation : deviation - realised;
    if (error < least_error) {
      least_error = error;
      best.increment_correction = faster != 0 ? increment_ns + d : increment_ns - d;
      best.period = (uint32_t)period;
      best.addend = (uint32_t)(faster != 0 ? nominal_addend + realised : nominal_addend - realised);
    }
  }
  return best;
}

#endif
