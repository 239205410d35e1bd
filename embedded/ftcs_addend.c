/* SPDX-License-Identifier: MIT */
/* Length: one header and one source, so that a project takes the servo by copying two files. */
#include "ftcs_addend.h"

/* Times are differences in 2^-16 ns below 2^61, so that sums of a few of them fit 64 bits; what is
 * longer than FTCS_LONGEST_NS (4.9 hours) is cut there and taken for a jump. */
#define FTCS_ONE_NS INT64_C(65536)
#define FTCS_LONGEST_NS (INT64_C(1) << 44)
#define FTCS_LONGEST (FTCS_LONGEST_NS * FTCS_ONE_NS)
#define FTCS_LONGEST_LATENCY \
  ((INT64_C(1) << 36) * FTCS_ONE_NS) /* 69 s from the stamp to the command */
#define FTCS_HOUR_NS INT64_C(3600000000000)
#define FTCS_FULL_GAIN 65536U
#define FTCS_OUTAGE_INTERVALS 4

#define FTCS_NEGATIVE 0x100U

enum { FTCS_EMPTY = 0, FTCS_PRIMED = 1, FTCS_ACTING = 2 };

/* ---- arithmetic ---- */

static uint64_t magnitude(int64_t x) { return x < 0 ? UINT64_C(0) - (uint64_t)x : (uint64_t)x; }

static int64_t with_sign(uint64_t value, int negative) {
  return negative != 0 ? -(int64_t)value : (int64_t)value;
}

static int64_t clamp(int64_t x, int64_t low, int64_t high) {
  return x < low ? low : (x > high ? high : x);
}

/* Leading zeros of a number that is not zero. */
static unsigned leading_zeros(uint32_t x) {
#if defined(__GNUC__) && !defined(FTCS_ADDEND_PORTABLE)
  return (unsigned)__builtin_clz(x);
#else
  unsigned zeros = 0;
  while (x < 0x80000000U) {
    x <<= 1;
    ++zeros;
  }
  return zeros;
#endif
}

/* The 32 highest bits of a number that is not zero, and how far it was shifted to the left for
 * that. */
static uint32_t highest_bits(uint64_t x, unsigned* shift) {
  const uint32_t upper = (uint32_t)(x >> 32);
  const uint32_t lower = (uint32_t)x;
  const unsigned zeros = leading_zeros(upper != 0U ? upper : lower);
  *shift = zeros;
  if (upper == 0U) {
    *shift += 32U;
    return lower << zeros;
  }
  return zeros == 0U ? upper : (upper << zeros) | (lower >> (32U - zeros));
}

/* A digit of 16 bits of 2^16 rest / d with a zero behind the rest; rest < d, the highest bit of d
 * is set. (Knuth, The Art of Computer Programming 2, 4.3.1 D: the guess is at most two too large.)
 */
static uint32_t digit(uint32_t* rest, uint32_t d) {
  const uint32_t upper = d >> 16;
  uint32_t guess = *rest / upper;
  const uint32_t wanted = guess * (d & 0xFFFFU);
  uint32_t have = (*rest - guess * upper) << 16;
  int tries = 0;
  while (have < wanted && tries < 2) {
    --guess;
    have += d;
    if (have < d) break; /* beyond 32 bits, so beyond `wanted` */
    ++tries;
  }
  *rest = have - wanted;
  return guess;
}

/* n / d to 30 bits, d > 0 and |n| < 4 d. */
static ftcs_addend_ratio quotient(int64_t n, int64_t d) {
  unsigned up;
  unsigned down;
  uint32_t rest;
  uint32_t divisor;
  uint32_t first;
  unsigned shift;
  if (n == 0) return 0;
  rest = highest_bits(magnitude(n), &up);
  divisor = highest_bits((uint64_t)d, &down);
  shift = 32U + up - down;
  if (rest >= divisor) {
    rest >>= 1;
    --shift;
  }
  if (shift >= 96U) return 0; /* nothing that could be seen */
  first = digit(&rest, divisor);
  return ((uint64_t)((first << 16) + digit(&rest, divisor)) << 32) | (n < 0 ? FTCS_NEGATIVE : 0U) |
         shift;
}

/* x r towards zero, |x| < 2^62 and |x r| < 2^63. */
static int64_t times(int64_t x, ftcs_addend_ratio r) {
  const uint64_t size = magnitude(x);
  const uint32_t mantissa = (uint32_t)(r >> 32);
  const uint32_t shift = (uint32_t)r & 0xFFU;
  uint64_t product = (uint64_t)(uint32_t)(size >> 32) * mantissa;
  product += ((uint64_t)(uint32_t)size * mantissa) >> 32;
  product = shift >= 32U ? product >> (shift - 32U) : product << (32U - shift);
  return with_sign(product, (x < 0) != (((uint32_t)r & FTCS_NEGATIVE) != 0U));
}

/* x part / 65536 towards zero, part <= 2^17, |x| < 2^62. */
static int64_t part_of(int64_t x, uint32_t part_q16) {
  const uint64_t size = magnitude(x);
  return with_sign(
      (size >> 16) * part_q16 + (((uint32_t)size & 0xFFFFU) * (uint64_t)part_q16 >> 16), x < 0);
}

/* An addend in 2^-16 units to a whole one. */
static int64_t whole(int64_t addend_q16) { return (addend_q16 + 32768) / 65536; }

/* a - b modulo 2^64 ns (a counter that wraps is no event), cut at +- FTCS_LONGEST_NS. */
static int64_t difference_ns(int64_t a, int64_t b) {
  const uint64_t d = (uint64_t)a - (uint64_t)b;
  if (d + (uint64_t)FTCS_LONGEST_NS <= 2U * (uint64_t)FTCS_LONGEST_NS) return (int64_t)d;
  return d < UINT64_C(0x8000000000000000) ? FTCS_LONGEST_NS : -FTCS_LONGEST_NS;
}

static int64_t difference(int64_t a_ns, uint16_t a_fraction, int64_t b_ns, uint16_t b_fraction) {
  return difference_ns(a_ns, b_ns) * FTCS_ONE_NS + ((int32_t)a_fraction - (int32_t)b_fraction);
}

static int64_t shifted_ns(int64_t ns, int64_t by_ns) {
  if (by_ns > 0) return ns > INT64_MAX - by_ns ? INT64_MAX : ns + by_ns;
  return ns < INT64_MIN - by_ns ? INT64_MIN : ns + by_ns;
}

/* ---- what the clock did ---- */

/* What the clock would have shown at W while it showed `local` since start_ns. */
static int64_t at_tracking_rate(const ftcs_addend_servo* s, int64_t local) {
  return local + times(local < s->length ? local : s->length, s->shortening);
}

/* From start_ns on, at most FTCS_LONGEST. */
static int64_t since_start(const ftcs_addend_servo* s, int64_t local_ns, uint16_t fraction) {
  return difference(local_ns, fraction, s->start_ns, 0);
}

/* The history begins with this reading: a correction that is under way goes on. */
static void begin_at(ftcs_addend_servo* s, int64_t local_ns, uint16_t fraction) {
  const int64_t gone = since_start(s, local_ns, 0);
  if (gone < 0 || gone >= s->length) {
    s->length = 0;
    s->shortening = 0;
  } else if (s->config->no_timer == 0U) {
    s->length -= gone;
  } else {
    /* it holds until the next command */
  }
  s->start_ns = local_ns;
  s->before_start = -at_tracking_rate(s, (int64_t)fraction);
}

/* What the wanted rate gains on the written one in `time`. */
static int64_t gained(const ftcs_addend_servo* s, int64_t time) {
  return times(time, s->per_addend) * s->fraction / 65536;
}

static void plan(ftcs_addend_servo* s, int64_t start_ns, int64_t length, uint32_t correction) {
  s->start_ns = start_ns;
  s->length = length;
  s->shortening = quotient((int64_t)s->addend - (int64_t)correction, (int64_t)correction);
}

/* ---- configuration ---- */

ftcs_addend_config ftcs_addend_default_config(uint32_t nominal_addend) {
  ftcs_addend_config c = {
      0, 500000, 500000, 4096, FTCS_ADDEND_UNBOUNDED, FTCS_ADDEND_UNBOUNDED, 1000, 5000, 0, 0,
      0, 1,      0,      0};
  const uint32_t above = UINT32_MAX - nominal_addend;
  c.nominal_addend = nominal_addend;
  if (above < nominal_addend / 2U && nominal_addend != 0U) {
    c.limit_ppm = (uint32_t)((uint64_t)above * 1000000U / nominal_addend);
    c.plausible_ppm = c.limit_ppm;
  }
  return c;
}

static int32_t time_error(const ftcs_addend_config* c) {
  const int ranges = c->interval_ns < 0 || c->interval_ns > FTCS_HOUR_NS || c->correction_ns < 0 ||
                     c->correction_ns > FTCS_HOUR_NS || c->step_ns < 0 || c->step_ns > FTCS_HOUR_NS;
  const int longer = c->interval_ns > 0 && c->correction_ns > c->interval_ns;
  return ranges != 0 || longer != 0 ? FTCS_ADDEND_BAD_TIME : FTCS_ADDEND_OK;
}

static int memory_is_valid(uint32_t memory) {
#ifdef FTCS_ADDEND_WITHOUT_QUIET
  return memory == 0U;
#else
  return memory == 0U || (memory >= 8U && memory <= 255U);
#endif
}

/* nominal ppm / 10^6 */
static uint32_t part_per_million(uint32_t nominal, uint32_t ppm) {
  return (uint32_t)((uint64_t)nominal * ppm / 1000000U);
}

static int32_t config_error(const ftcs_addend_config* c) {
  const uint32_t widest = c->limit_ppm > c->plausible_ppm ? c->limit_ppm : c->plausible_ppm;
  if (c->limit_ppm < 1U || c->plausible_ppm < 1U || widest > 500000U) return FTCS_ADDEND_BAD_LIMIT;
  if (c->nominal_addend == 0U ||
      UINT32_MAX - c->nominal_addend < part_per_million(c->nominal_addend, widest)) {
    return FTCS_ADDEND_BAD_NOMINAL;
  }
  if (c->gain_q16 > FTCS_FULL_GAIN) return FTCS_ADDEND_BAD_GAIN;
  if (c->band_leave_ns < c->band_enter_ns || c->lock_leave_ns < c->lock_enter_ns) {
    return FTCS_ADDEND_BAD_BAND;
  }
  if (memory_is_valid(c->quiet_memory) == 0) return FTCS_ADDEND_BAD_MEMORY;
  return time_error(c);
}

int32_t ftcs_addend_init(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                         uint32_t addend_now) {
  uint8_t* const bytes = (uint8_t*)servo;
  uint32_t i;
  const int32_t error = config_error(config);
  if (error == FTCS_ADDEND_OK) {
    const uint32_t limit = part_per_million(config->nominal_addend, config->limit_ppm);
    for (i = 0; i < sizeof *servo; ++i) bytes[i] = 0;
    servo->config = config;
    servo->slowest = config->nominal_addend - limit;
    servo->fastest = config->nominal_addend + limit;
    servo->addend = addend_now;
    servo->per_addend = quotient(1, (int64_t)config->nominal_addend);
    servo->plausible = part_per_million(config->nominal_addend, config->plausible_ppm);
    if (addend_now == 0U || addend_now < servo->slowest || addend_now > servo->fastest) {
      return FTCS_ADDEND_BAD_ADDEND;
    }
  }
  return error;
}

/* ---- one sample ---- */

typedef struct {
  int64_t reference;      /* elapsed since the last sample, */
  int64_t shown;          /* and what the clock would have shown at W */
  int64_t ahead;          /* what W lacks over `shown` */
  int64_t residue;        /* filtered minus measured reference */
  int64_t innovation;     /* measured minus predicted reference */
  int64_t since;          /* from start_ns to the sample */
  ftcs_addend_ratio rate; /* W(n+1) / W(n) - 1 */
  int64_t wanted_q16;     /* W(n+1), not rounded, not limited */
  int64_t wanted;         /* rounded */
} progress;

static void remember(ftcs_addend_servo* s, const ftcs_addend_sample* in) {
  s->origin_ns = in->origin_ns;
  s->origin_fraction = in->origin_fraction;
  s->local_ns = in->local_ns;
  s->local_fraction = in->local_fraction;
}

void ftcs_addend_reset(ftcs_addend_servo* servo) {
  servo->phase = FTCS_EMPTY;
  servo->interval = 0;
  servo->inside = 0;
  servo->converged = 0;
  servo->locked = 0;
  servo->deviation = 0;
#ifndef FTCS_ADDEND_WITHOUT_QUIET
  servo->memory = 0;
#endif
}

void ftcs_addend_prime(ftcs_addend_servo* servo, const ftcs_addend_sample* sample) {
  if (servo->phase == FTCS_EMPTY) {
    remember(servo, sample);
    begin_at(servo, sample->local_ns, sample->local_fraction);
    servo->phase = FTCS_PRIMED;
  }
}

#ifndef FTCS_ADDEND_WITHOUT_QUIET

/* Too long a memory follows the oscillator late, and its innovations are correlated: their signs
 * tell it whatever the noise. A quarter less then, one sample more while they are white. */
static void adapt_memory(ftcs_addend_servo* s, int64_t innovation) {
  const uint8_t sign = innovation < 0 ? 2U : 1U;
  const int same = s->last_sign == sign ? 256 : -256;
  if (s->last_sign != 0U) s->whiteness = (int16_t)(s->whiteness + (same - s->whiteness) / 16);
  s->last_sign = sign;
  if (s->whiteness > 96) {
    s->memory = (uint16_t)(s->memory - s->memory / 4U);
    s->whiteness = 48;
  } else if (s->whiteness < 32 && s->memory < s->config->quiet_memory) {
    ++s->memory;
  } else {
    /* as it is */
  }
}

/* Expanding-memory filter of degree one with n samples: of an innovation e the reference gets 2 (2
 * n - 1) / (n (n + 1)) e, the rate 6 / (n (n + 1)) e per interval. With n = 2 that is k(n) of the
 * last two samples. Zero: the sample is rejected. */
static int filter(ftcs_addend_servo* s, progress* p) {
  const int64_t drift = gained(s, p->shown);
  const int64_t innovation = p->ahead - drift - s->residue;
  const int unlike =
      s->memory >= 8U && magnitude(innovation) / 4096U > 8U * (uint64_t)s->deviation + 16U;
  if (unlike != 0 && s->doubted == 0U) {
    s->doubted = 1;
    return 0;
  }
  if (unlike != 0 || s->memory < 2U) {
    s->memory = 2;
    s->whiteness = 0;
    s->last_sign = 0;
  } else {
    const uint32_t pairs = (uint32_t)s->memory * ((uint32_t)s->memory + 1U);
    p->innovation = innovation;
    p->residue = part_of(innovation, (4U * (uint32_t)s->memory - 2U) * 65536U / pairs) - innovation;
    p->ahead = drift + part_of(innovation, 6U * 65536U / pairs);
  }
  s->doubted = 0;
  return 1;
}

#endif

/* What lies between two samples. Returns an enum ftcs_addend_verdict. */
static int32_t compare(const ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p) {
  const int newer_local = in->local_ns > s->local_ns ||
                          (in->local_ns == s->local_ns && in->local_fraction > s->local_fraction);
  p->reference = difference(in->origin_ns, in->origin_fraction, s->origin_ns, s->origin_fraction);
  p->since = since_start(s, in->local_ns, in->local_fraction);
  if (p->reference <= 0 && newer_local == 0) return FTCS_ADDEND_DUPLICATE;
  if (p->reference <= 0 || newer_local == 0 || p->reference >= FTCS_LONGEST ||
      p->since >= FTCS_LONGEST) {
    return FTCS_ADDEND_IMPLAUSIBLE;
  }
  if (p->since < 0) return FTCS_ADDEND_STALE;
  p->shown = s->before_start + at_tracking_rate(s, p->since);
  p->ahead = p->reference - p->shown;
  return p->shown <= 0 || p->ahead / 4 >= p->shown ? FTCS_ADDEND_IMPLAUSIBLE : FTCS_ADDEND_USED;
}

/* The rate that tracks. */
static int32_t track(ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p) {
  const int32_t verdict = compare(s, in, p);
  int64_t excess;
  if (verdict != FTCS_ADDEND_USED) return verdict;
  p->residue = 0;
  p->innovation = 0;
#ifndef FTCS_ADDEND_WITHOUT_QUIET
  if (s->config->quiet_memory != 0U && filter(s, p) == 0) return FTCS_ADDEND_REJECTED;
#endif
  p->rate = quotient(p->ahead, p->shown);
  p->wanted_q16 = (int64_t)s->addend * 65536;
  p->wanted_q16 += times(p->wanted_q16, p->rate);
  p->wanted = whole(p->wanted_q16);
  excess = p->wanted - (int64_t)s->config->nominal_addend;
  return magnitude(excess) > s->plausible ? FTCS_ADDEND_IMPLAUSIBLE : FTCS_ADDEND_USED;
}

/* [T_sync] Of the last two gaps the shorter: a missing message does not make the interval longer.
 */
static int64_t interval_of(const ftcs_addend_servo* s, int64_t gap) {
  if (s->config->interval_ns > 0) return s->config->interval_ns * FTCS_ONE_NS;
  return s->interval > 0 && s->interval < gap ? s->interval : gap;
}

/* Table 1: whether p holds. The band with hysteresis, and `dwell` offsets inside it in a row. */
static int converged(ftcs_addend_servo* s, int64_t offset) {
  const ftcs_addend_config* c = s->config;
  const uint64_t size = magnitude(offset);
  if (s->converged != 0U) {
    if (c->band_leave_ns != FTCS_ADDEND_UNBOUNDED && size >= (uint64_t)c->band_leave_ns * 65536U) {
      s->converged = 0;
      s->inside = 0;
    }
    return s->converged != 0U;
  }
  if (c->band_enter_ns != FTCS_ADDEND_UNBOUNDED && size >= (uint64_t)c->band_enter_ns * 65536U) {
    s->inside = 0;
    return 0;
  }
  if (s->inside < UINT16_MAX) ++s->inside;
  if (s->inside >= c->dwell) s->converged = 1;
  return s->converged != 0U;
}

/* The part of the offset that this correction removes. */
static int64_t removed_part(ftcs_addend_servo* s, int64_t offset) {
  if (s->config->quiet_memory != 0U) return offset;
  if (s->phase != FTCS_ACTING && s->config->dwell > 0U) return offset;
  return converged(s, offset) != 0 ? part_of(offset, s->config->gain_q16) : offset;
}

/* Waiting: from the sample to the moment of writing. In reference time; *at_old_rate at W(n). */
static int64_t waiting(const ftcs_addend_servo* s, const progress* p, int64_t shown,
                       int64_t* at_old_rate) {
  const int64_t left = s->length - p->since;
  *at_old_rate = shown;
  if (left > 0) *at_old_rate += times(shown < left ? shown : left, s->shortening);
  return *at_old_rate + times(*at_old_rate, p->rate);
}

/* The tracking addend takes effect, and what has been waited is expressed in it. */
static void follow(ftcs_addend_servo* s, const progress* p, int64_t waited, int64_t waited_before) {
  const int64_t tracking = clamp(p->wanted, s->slowest, s->fastest);
  if (tracking == p->wanted) {
    s->fraction = (int32_t)(p->wanted_q16 - tracking * 65536);
    s->before_start = waited - gained(s, waited);
  } else {
    const ftcs_addend_ratio rate = quotient(tracking - (int64_t)s->addend, (int64_t)s->addend);
    s->fraction = 0;
    s->before_start = waited_before + times(waited_before, rate);
  }
#ifndef FTCS_ADDEND_WITHOUT_QUIET
  s->residue = p->residue;
#endif
  s->addend = (uint32_t)tracking;
}

static void steer(ftcs_addend_servo* s, const ftcs_addend_sample* in, const progress* p,
                  int64_t measured, int64_t interval, ftcs_addend_command* out) {
  const ftcs_addend_config* c = s->config;
  const int64_t shown =
      clamp(difference(in->now_ns, 0, in->local_ns, in->local_fraction), 0, FTCS_LONGEST_LATENCY);
  int64_t waited_before;
  const int64_t waited = waiting(s, p, shown, &waited_before);
  const int64_t offset =
      clamp(measured - p->residue + (shown - waited), -FTCS_LONGEST, FTCS_LONGEST);
  const int64_t wanted_time = c->correction_ns > 0 ? c->correction_ns * FTCS_ONE_NS : interval;
  int64_t time = c->no_timer != 0U ? wanted_time : wanted_time - waited;
  int64_t start_ns = shifted_ns(in->local_ns, (shown + FTCS_ONE_NS - 1) / FTCS_ONE_NS);
  int64_t removed = 0;
  int64_t bent = p->wanted;
  int64_t correction;
  s->earlier = s->length > p->since + shown ? s->shortening : p->rate;
  if (time <= wanted_time / 2) time = wanted_time / 2 + 1;
  if (s->phase != FTCS_ACTING && c->step_ns > 0 &&
      magnitude(offset) >= (uint64_t)c->step_ns * 65536U) {
    out->step_ns = -(offset / 65536);
    if (magnitude(offset) >= (uint64_t)FTCS_LONGEST / 2U) { /* a clock that starts in 1970 */
      const uint64_t back = (uint64_t)in->origin_ns - (uint64_t)in->local_ns;
      out->step_ns = (int64_t)back;
    }
    start_ns = shifted_ns(start_ns, out->step_ns);
    s->local_ns = shifted_ns(s->local_ns, out->step_ns);
  } else {
    removed = clamp(removed_part(s, offset), -3 * time, 3 * time);
    bent = whole(p->wanted_q16 - times(p->wanted_q16, quotient(removed, time)));
  }
  follow(s, p, waited, waited_before);
  correction = clamp(bent, s->slowest, s->fastest);
  if (correction == bent) {
    s->phase = FTCS_ACTING;
  } else {
    removed = times(time, quotient((int64_t)s->addend - correction, (int64_t)s->addend));
  }
  /* In T_c the clock shows p offset less. */
  time = c->no_timer != 0U ? FTCS_LONGEST : (time - removed + 32768) / 65536 * FTCS_ONE_NS;
  plan(s, start_ns, time, (uint32_t)correction);
  out->act = 1;
  out->addend = (uint32_t)correction;
  out->next_addend = s->addend;
  out->until_ns = c->no_timer != 0U ? INT64_MAX : shifted_ns(start_ns, time / FTCS_ONE_NS);
}

/* Lock, deviation. */
static void watch(ftcs_addend_servo* s, int64_t offset, int64_t innovation) {
  const uint64_t size = magnitude(offset);
  const uint64_t unlike = magnitude(s->config->quiet_memory != 0U ? innovation : offset) / 4096U;
  const uint32_t seen = unlike < UINT32_MAX / 2U ? (uint32_t)unlike : UINT32_MAX / 2U;
  if (s->phase != FTCS_ACTING) return;
  if (size < (uint64_t)s->config->lock_enter_ns * 65536U) s->locked = 1;
  if (size >= (uint64_t)s->config->lock_leave_ns * 65536U) s->locked = 0;
  s->deviation = s->deviation == 0U ? seen : s->deviation - s->deviation / 8U + seen / 8U;
}

/* Returns an enum ftcs_addend_verdict. */
static int32_t take(ftcs_addend_servo* s, const ftcs_addend_sample* in, int64_t offset,
                    ftcs_addend_command* out) {
  progress p;
  const int32_t verdict = track(s, in, &p);
  if (verdict == FTCS_ADDEND_USED) {
    const int64_t interval = interval_of(s, p.reference);
    if (p.reference / FTCS_OUTAGE_INTERVALS > interval) {
      /* What the clock gathered in an outage is an offset to be removed as at the start. */
      s->phase = FTCS_PRIMED;
      s->converged = 0;
      s->inside = 0;
    }
    watch(s, offset, p.innovation);
    remember(s, in);
    steer(s, in, &p, offset, interval, out);
    s->interval = p.reference;
#ifndef FTCS_ADDEND_WITHOUT_QUIET
    if (s->config->quiet_memory != 0U) adapt_memory(s, p.innovation);
#endif
  }
  return verdict;
}

static int64_t offset_of(const ftcs_addend_sample* in) {
  const int64_t delay = clamp(in->path_delay_scaled, -FTCS_LONGEST, FTCS_LONGEST);
  return difference(in->local_ns, in->local_fraction, in->origin_ns, in->origin_fraction) - delay;
}

static int32_t state_of(const ftcs_addend_servo* s) {
  if (s->phase != FTCS_ACTING && s->interval == 0) return FTCS_ADDEND_WAITING;
  return s->locked != 0U ? FTCS_ADDEND_LOCKED : FTCS_ADDEND_ACQUIRING;
}

ftcs_addend_command ftcs_addend_update(ftcs_addend_servo* servo, const ftcs_addend_sample* sample) {
  const int64_t offset = offset_of(sample);
  ftcs_addend_command out;
  out.verdict = FTCS_ADDEND_USED;
  out.act = 0;
  out.addend = servo->addend;
  out.next_addend = servo->addend;
  out.until_ns = 0;
  out.step_ns = 0;
  if (servo->phase != FTCS_EMPTY) out.verdict = take(servo, sample, offset, &out);
  if (out.verdict == FTCS_ADDEND_IMPLAUSIBLE) {
    /* Which of the two samples is wrong cannot be known: again from the newer one. */
    ftcs_addend_reset(servo);
  }
  ftcs_addend_prime(servo, sample);
  out.offset_ns = (offset + 32768) / 65536;
  out.state = state_of(servo);
  /* 5/4: from the mean of magnitudes to the standard deviation of a normal distribution, sqrt(pi /
   * 2). */
  out.deviation_ns = (servo->deviation / 64U) * 5U + (servo->deviation % 64U) * 5U / 64U;
  return out;
}

/* ---- what really happened ---- */

void ftcs_addend_wrote(ftcs_addend_servo* servo, int64_t at_ns, uint32_t addend,
                       uint32_t next_addend) {
  if (servo->interval != 0) {
    const int64_t next = clamp(next_addend, servo->slowest, servo->fastest);
    const int64_t changed = next - (int64_t)servo->addend;
    const int64_t late =
        clamp(since_start(servo, at_ns, 0), -servo->before_start / 2, FTCS_LONGEST_LATENCY);
    const int64_t before = servo->before_start + late + times(late, servo->earlier);
    const int64_t length = servo->length > late ? servo->length - late : 0;
    servo->before_start = before + times(before, quotient(changed, (int64_t)servo->addend));
    servo->fraction = (int32_t)clamp(servo->fraction - changed * 65536, -INT32_MAX, INT32_MAX);
    servo->addend = (uint32_t)next;
    plan(servo, shifted_ns(servo->start_ns, late / FTCS_ONE_NS),
         servo->config->no_timer != 0U ? FTCS_LONGEST : length,
         (uint32_t)clamp(addend, servo->slowest, servo->fastest));
  }
}

void ftcs_addend_wrote_next(ftcs_addend_servo* servo, int64_t at_ns) {
  if (servo->config->no_timer == 0U) {
    servo->length = clamp(since_start(servo, at_ns, 0), 0, FTCS_LONGEST);
  }
}

void ftcs_addend_stepped(ftcs_addend_servo* servo, int64_t by_ns) {
  servo->local_ns = shifted_ns(servo->local_ns, by_ns);
  servo->start_ns = shifted_ns(servo->start_ns, by_ns);
}

/* ---- questions ---- */

int64_t ftcs_addend_elapsed(const ftcs_addend_servo* servo, int64_t local_ns) {
  const int64_t since = since_start(servo, local_ns, 0);
  if (since >= 0) return servo->before_start + at_tracking_rate(servo, since);
  return difference(local_ns, 0, servo->local_ns, servo->local_fraction);
}

int32_t ftcs_addend_state_at(const ftcs_addend_servo* servo, int64_t now_ns) {
  const int64_t silence = difference_ns(now_ns, servo->local_ns);
  const int64_t interval = interval_of(servo, servo->interval) / FTCS_ONE_NS;
  const int coasting = servo->interval > 0 && silence / FTCS_OUTAGE_INTERVALS > interval;
  return coasting != 0 ? (int32_t)FTCS_ADDEND_COASTING : state_of(servo);
}

int32_t ftcs_addend_rate_ppb(const ftcs_addend_servo* servo) {
  const int64_t nominal = (int64_t)servo->config->nominal_addend;
  return (int32_t)(((int64_t)servo->addend - nominal) * 1000000000 / nominal);
}

const char* ftcs_addend_state_name(int32_t state) {
  static const char* const names[4] = {"waiting", "acquiring", "locked", "coasting"};
  return state >= 0 && state < 4 ? names[state] : "?";
}
