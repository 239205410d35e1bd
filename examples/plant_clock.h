/* SPDX-License-Identifier: MIT */
/* Plant time of the examples: a system clock on the epoch of distributed clocks, 2000-01-01. A
 * program that includes it defines _GNU_SOURCE first. */
#ifndef FTCS_EXAMPLES_PLANT_CLOCK_H
#define FTCS_EXAMPLES_PLANT_CLOCK_H

#include <stdint.h>
#include <string.h>
#include <time.h>

/* "tai": CLOCK_TAI, which a PTP program has set; "realtime": CLOCK_REALTIME. Else -1. */
static clockid_t plant_clock(const char* name) {
  if (strcmp(name, "tai") == 0) return CLOCK_TAI;
  return strcmp(name, "realtime") == 0 ? CLOCK_REALTIME : (clockid_t)-1;
}

static int64_t plant_ns(clockid_t clock) {
  static const int64_t kDcEpoch = 946684800;
  struct timespec now;
  clock_gettime(clock, &now);
  return (now.tv_sec - kDcEpoch) * 1000000000 + now.tv_nsec;
}

#endif
