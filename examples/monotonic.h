/* SPDX-License-Identifier: MIT */
/* CLOCK_MONOTONIC in nanoseconds, and sleeping until one of its instants: what the loops here have
 * in common. A program that includes it defines _GNU_SOURCE, or _POSIX_C_SOURCE as 200809L, first.
 */
#ifndef FTCS_EXAMPLES_MONOTONIC_H
#define FTCS_EXAMPLES_MONOTONIC_H

#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

static const int64_t kSecond = 1000000000;

static int64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

static void sleep_until(int64_t instant_ns) {
  struct timespec wake;
  wake.tv_sec = instant_ns / kSecond;
  wake.tv_nsec = instant_ns % kSecond;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL) == EINTR) continue;
}

#endif
