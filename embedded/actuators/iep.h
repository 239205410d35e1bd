/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ACTUATOR_IEP_H
#define FTCS_ACTUATOR_IEP_H

/* TI's industrial Ethernet peripheral (PRU-ICSS, ICSSG): the time moves on by increment_ns each
 * tick; slow compensation adds or takes one nanosecond once in COMPENSATION ticks. A driver that
 * divides once has steps and, near rate 1, a dead band. Here the period is chosen anew each time it
 * is written (each Sync, or from a timer), and what it lacked is carried on: no dead band. */

#include <stdint.h>

typedef struct ftcs_iep {
  uint32_t increment_ns; /* of a tick, at most 63: 5 at 200 MHz */
  uint32_t longest;      /* largest COMPENSATION, 2^24 - 1 or 2^32 - 1 */
  int64_t owed;          /* nanoseconds times nominal addend, not yet realised */
} ftcs_iep;

typedef struct ftcs_iep_rate {
  uint32_t period; /* COMPENSATION in ticks; zero: none */
  int32_t sign;    /* +1: one nanosecond more each period, -1: less */
  uint32_t addend; /* realised, in units of nominal_addend, rounded */
} ftcs_iep_rate;

/* For the next `ticks` ticks, 1 to 2^25 (0.17 s at 200 MHz; from a timer where Syncs are rarer);
 * |addend - nominal_addend| at most half of nominal_addend. */
static inline ftcs_iep_rate ftcs_iep_next(ftcs_iep* iep, uint32_t addend, uint32_t nominal_addend,
                                          uint32_t ticks) {
  ftcs_iep_rate rate = {0, 1, nominal_addend};
  const int64_t deviation = (int64_t)addend - (int64_t)nominal_addend;
  const int64_t wanted = deviation * (int64_t)ticks * (int64_t)iep->increment_ns + iep->owed;
  const uint64_t size = wanted < 0 ? (uint64_t)(-wanted) : (uint64_t)wanted;
  const uint64_t whole = (uint64_t)nominal_addend * ticks; /* one nanosecond each tick */
  int64_t realised = 0;
  if (size >= nominal_addend) { /* else less than a nanosecond: owed */
    uint64_t period = (whole + size / 2U) / size;
    if (period < 1U) period = 1U;
    if (period <= iep->longest) {
      rate.period = (uint32_t)period;
      rate.sign = wanted < 0 ? -1 : 1;
      realised = (int64_t)(whole / period) * rate.sign;
      rate.addend =
          (uint32_t)((int64_t)nominal_addend +
                     (int64_t)(nominal_addend / (iep->increment_ns * period)) * rate.sign);
    }
  }
  iep->owed = wanted - realised;
  return rate;
}

#endif
