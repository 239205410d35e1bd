/* SPDX-License-Identifier: MIT */
#ifndef FTCS_NOW_H
#define FTCS_NOW_H

/* What time it is, and between which two instants it surely is: for programs in C and C++ on a
 * machine where `ftcs ptp --time-page PATH` runs. Needs nothing but this header and
 * CLOCK_MONOTONIC_RAW, which the vDSO reads:
 *
 *     const struct ftcs_time_page* page = ftcs_open_time("/run/ftcs-time");
 *     struct ftcs_time now;
 *     if (page && ftcs_now(page, &now) == FTCS_LOCKED) use(now.earliest_ns, now.latest_ns);
 *
 * With r the reading of CLOCK_MONOTONIC_RAW, d = r - raw_ns, and one consistent copy of the page:
 *
 *     time = time_ns + rate d        half width = bound_ns + growth |d|
 */

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#ifdef __cplusplus
extern "C" {
#endif

enum ftcs_time_state {
  FTCS_UNKNOWN = 0,  /* nothing is known: no interval */
  FTCS_UNLOCKED = 1, /* an interval, of a clock that is not locked */
  FTCS_LOCKED = 2,
  FTCS_HOLDOVER = 3 /* no news from the reference, or the writer is gone: the interval grows */
};

#define FTCS_TIME_PAGE_MAGIC 0x46544353u
#define FTCS_TIME_PAGE_VERSION 1u

/* Written by one process, read by any. An odd sequence: a write is under way. */
struct ftcs_time_page {
  uint32_t magic;
  uint32_t version;
  uint32_t sequence;
  uint32_t state;
  int64_t raw_ns;   /* CLOCK_MONOTONIC_RAW at the base */
  int64_t time_ns;  /* of the reference at the base, ns since its epoch */
  double rate;      /* of the reference in units of CLOCK_MONOTONIC_RAW */
  double bound_ns;  /* half width at the base */
  double growth;    /* of the half width, ns per ns */
  int64_t fresh_ns; /* older than this, the writer counts as gone */
};

struct ftcs_time {
  int64_t time_ns;
  int64_t earliest_ns;
  int64_t latest_ns;
};

#ifdef __cplusplus
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast" /* C has no other */
#endif

/* Maps the page, to read. NULL with errno: it cannot be had. It stays mapped until the program
 * ends. */
static inline const struct ftcs_time_page* ftcs_open_time(const char* path) {
  const int file = open(path, O_RDONLY | O_CLOEXEC);
  void* page = NULL;
  if (file < 0) return NULL;
  /* What is shorter cannot be read: the reader would end by SIGBUS. */
  if (lseek(file, 0, SEEK_END) < (off_t)sizeof(struct ftcs_time_page)) {
    close(file);
    errno = EINVAL;
    return NULL;
  }
  page = mmap(NULL, sizeof(struct ftcs_time_page), PROT_READ, MAP_SHARED, file, 0);
  close(file);
  return page == MAP_FAILED ? NULL : (const struct ftcs_time_page*)page;
}

/* The interval at a given reading of CLOCK_MONOTONIC_RAW, of now or of the last three seconds.
 * Never waits for the writer more than a few tries. */
static inline enum ftcs_time_state ftcs_time_at(const struct ftcs_time_page* page, int64_t raw_ns,
                                                struct ftcs_time* result) {
  int tries = 0;
  if (page->magic != FTCS_TIME_PAGE_MAGIC || page->version != FTCS_TIME_PAGE_VERSION) {
    return FTCS_UNKNOWN;
  }
  for (tries = 0; tries < 1000; ++tries) {
    const uint32_t before = __atomic_load_n(&page->sequence, __ATOMIC_ACQUIRE);
    const uint32_t state = page->state;
    const int64_t passed = raw_ns - page->raw_ns;
    const int64_t base = page->time_ns;
    const double extra = (page->rate - 1.0) * (double)passed;
    const double half = page->bound_ns + page->growth * (double)(passed < 0 ? -passed : passed);
    const int64_t fresh = page->fresh_ns;
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if ((before & 1u) != 0 || __atomic_load_n(&page->sequence, __ATOMIC_RELAXED) != before)
      continue;
    if (state == FTCS_UNKNOWN || !(half < 9e18)) return FTCS_UNKNOWN;
    /* Written long after now: by a writer from before the machine was started again. */
    if (passed < -fresh) return FTCS_UNKNOWN;
    result->time_ns = base + passed + (int64_t)extra;
    result->earliest_ns = result->time_ns - (int64_t)half - 2;
    result->latest_ns = result->time_ns + (int64_t)half + 2;
    if (passed > fresh && state == FTCS_LOCKED) return FTCS_HOLDOVER;
    return (enum ftcs_time_state)state;
  }
  return FTCS_UNKNOWN;
}

static inline enum ftcs_time_state ftcs_now(const struct ftcs_time_page* page,
                                            struct ftcs_time* result) {
  struct timespec raw;
  clock_gettime(CLOCK_MONOTONIC_RAW, &raw);
  return ftcs_time_at(page, (int64_t)raw.tv_sec * 1000000000 + raw.tv_nsec, result);
}

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif

#endif /* FTCS_NOW_H */
