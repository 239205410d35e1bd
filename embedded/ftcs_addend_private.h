/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ADDEND_PRIVATE_H
#define FTCS_ADDEND_PRIVATE_H

/* What the sources of the servo share. Times are differences in 2^-16 ns below 2^60; what is longer
 * than FTCS_LONGEST (37 minutes) is cut there and taken for a jump. A signed number is shifted to
 * the right as every compiler for these processors does it: towards minus infinity. */

#include <stddef.h>

#include "ftcs_addend.h"

#define FTCS_LONGEST_NS (INT64_C(1) << 41)
#define FTCS_LONGEST (FTCS_LONGEST_NS << 16)
#define FTCS_LONGEST_LATENCY (INT64_C(1) << 52) /* 69 s from the stamp to the command */

typedef char ftcs_addend_shifts_signed[(-3 >> 1) == -2 ? 1 : -1];

#if defined(__GNUC__) && !defined(__ARM_ARCH_6M__)
#define FTCS_INLINE inline __attribute__((always_inline)) /* where -Os would not */
#else
#define FTCS_INLINE inline
#endif

/* FTCS alone, where every byte counts: no filter, no step, and somebody writes next_addend. */
#if defined(FTCS_ADDEND_BARE)
#define FTCS_OPTIONS 0
#else
#define FTCS_OPTIONS 1
#endif

static inline int32_t ftcs_addend_timed(const ftcs_addend_config* c) {
  return FTCS_OPTIONS == 0 || c->no_timer == 0U ? 1 : 0;
}
static inline int32_t ftcs_addend_steps(const ftcs_addend_config* c) {
  return FTCS_OPTIONS != 0 && c->step_ns != 0U ? 1 : 0;
}
static inline ftcs_addend_filter ftcs_addend_filter_of(const ftcs_addend_config* c) {
  return FTCS_OPTIONS != 0 ? c->filter : NULL;
}

enum { FTCS_EMPTY = 0, FTCS_PRIMED = 1, FTCS_ACTING = 2 };

/* a b, with no number signed, both, or the second one. A processor that multiplies words
 * to a word alone (Cortex-M0+) is served by four products of halves. */
#if defined(__ARM_ARCH_6M__) || defined(FTCS_ADDEND_NARROW)
uint64_t ftcs_addend_product(uint32_t a, uint32_t b);
int64_t ftcs_addend_signed_product(int32_t a, int32_t b);
int64_t ftcs_addend_mixed_product(uint32_t a, int32_t b);
#else
static inline uint64_t ftcs_addend_product(uint32_t a, uint32_t b) { return (uint64_t)a * b; }
static inline int64_t ftcs_addend_signed_product(int32_t a, int32_t b) { return (int64_t)a * b; }
static inline int64_t ftcs_addend_mixed_product(uint32_t a, int32_t b) { return (int64_t)a * b; }
#endif

/* n / d to 30 bits, d > 0, both below 2^62 in magnitude; from 4 on something between 2 and 4. */
ftcs_addend_ratio ftcs_addend_divide(int64_t n, int64_t d);

/* to / from - 1, from > 0. */
ftcs_addend_ratio ftcs_addend_change(uint32_t to, uint32_t from);

/* r x towards minus infinity, |x| < 2^59 and |r x| < 2^61. */
int64_t ftcs_addend_times(ftcs_addend_ratio r, int64_t x);

/* r addend in 2^-16, as ftcs_addend_times() has it. */
#if FTCS_OPTIONS
int64_t ftcs_addend_of(ftcs_addend_ratio r, uint32_t addend);
#else
static inline int64_t ftcs_addend_of(ftcs_addend_ratio r, uint32_t addend) {
  return ftcs_addend_times(r, (int64_t)addend << 16);
}
#endif

/* |x| in 1/16 ns, at most UINT32_MAX (0.27 s). */
static inline uint32_t ftcs_addend_size(int64_t x) {
  const uint64_t sign = (uint64_t)(x >> 63);
  const uint64_t size = (((uint64_t)x ^ sign) - sign) >> 12;
  return size > UINT32_MAX ? UINT32_MAX : (uint32_t)size;
}

/* a - b in 2^-16 ns, modulo 2^64 ns (a counter that wraps is no event), cut at +- FTCS_LONGEST. */
int64_t ftcs_addend_difference(int64_t a_ns, int64_t b_ns);

/* C went on until the clock showed this. */
void ftcs_addend_hold(ftcs_addend_servo* s, int64_t at_ns);

/* Modulo 2^64. */
static inline int64_t ftcs_addend_sum(int64_t a, int64_t b) {
  return (int64_t)((uint64_t)a + (uint64_t)b);
}

static inline int64_t ftcs_addend_less(int64_t a, int64_t b) {
  return (int64_t)((uint64_t)a - (uint64_t)b);
}

static inline int64_t ftcs_addend_clamp(int64_t x, int64_t low, int64_t high) {
  return x < low ? low : (x > high ? high : x);
}

/* The mean of the sizes, one more. */
static inline uint32_t ftcs_addend_average(uint32_t mean, uint32_t size) {
  return mean == 0U ? size : mean - mean / 8U + size / 8U;
}

/* What the correction under way makes from a reading until it ends: what the clock would show at W
 * more than at C. */
int64_t ftcs_addend_bend(const ftcs_addend_servo* s, uint32_t fraction, int64_t local_ns);

/* [T_sync] Of the last two gaps the shorter: a missing message does not make the interval longer.
 */
static inline int64_t ftcs_addend_interval(const ftcs_addend_servo* s, int64_t gap) {
  if (s->config->interval_ns != 0) return s->config->interval_ns * 65536;
  return s->interval != 0 && s->interval < gap ? s->interval : gap;
}

static inline int32_t ftcs_addend_state_of(const ftcs_addend_servo* s) {
  return s->interval != 0 ? (int32_t)FTCS_ADDEND_ACQUIRING + s->locked
                          : (int32_t)FTCS_ADDEND_WAITING;
}

#endif
