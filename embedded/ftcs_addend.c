/* SPDX-License-Identifier: MIT */
#include "ftcs_addend_private.h"

/* nominal (1 + ppm / 10^6), modulo 2^32: ppm in 2^-32 first, which is up to half a unit less. */
static uint32_t beyond(uint32_t nominal, uint32_t ppm) {
  const uint64_t part = (uint64_t)ppm * UINT32_C(2251799814) >> 19; /* 2^51 / 10^6 */
  return nominal + (uint32_t)(ftcs_addend_product(nominal, (uint32_t)part) >> 32);
}

void ftcs_addend_start(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                       uint32_t addend_now) {
  static const ftcs_addend_servo nothing = {0};
  const uint32_t nominal = config->nominal_addend;
  *servo = nothing;
  servo->config = config;
  servo->fastest = beyond(nominal, config->limit_ppm);
  servo->slowest = 2U * nominal - servo->fastest;
  servo->highest = beyond(nominal, config->plausible_ppm);
  servo->lowest = 2U * nominal - servo->highest;
  servo->addend = addend_now;
  servo->correction = addend_now;
}

void ftcs_addend_reset(ftcs_addend_servo* servo) {
  servo->phase = FTCS_EMPTY;
  servo->interval = 0;
  servo->inside = 0;
  servo->memory = 0;
  servo->locked = 0;
  servo->deviation = 0;
}

/* ---- what the clock did ---- */

/* What C makes while the clock shows so much: what the clock would show at W more than at C. */
static int64_t made_long(const ftcs_addend_servo* s, int64_t shown) {
  return ftcs_addend_times(ftcs_addend_change(s->addend, s->correction), shown);
}

static int64_t made(const ftcs_addend_servo* s, int64_t shown) {
  if ((uint32_t)((uint64_t)shown >> 26) > s->near) return made_long(s, shown);
  return ftcs_addend_times(s->bend, shown);
}

/* From a reading until the correction ends, modulo 2^64. */
static int64_t rest_of(const ftcs_addend_servo* s, uint32_t fraction, int64_t local_ns) {
  const uint64_t rest_ns = (uint64_t)s->until_ns - (uint64_t)local_ns;
  return (int64_t)((rest_ns << 16) - fraction);
}

void ftcs_addend_hold(ftcs_addend_servo* s, int64_t at_ns) {
  const int64_t length = ftcs_addend_difference(at_ns, s->start_ns);
  const int64_t late = length - ftcs_addend_difference(s->until_ns, s->start_ns);
  const ftcs_addend_ratio bend = ftcs_addend_change(s->addend, s->correction);
  s->expected = ftcs_addend_less(s->expected, ftcs_addend_times(bend, late));
  s->until_ns = ftcs_addend_sum(s->start_ns, length >> 16);
}

int64_t ftcs_addend_bend(const ftcs_addend_servo* s, uint32_t fraction, int64_t local_ns) {
  if (local_ns >= s->until_ns && ftcs_addend_timed(s->config) != 0) return 0;
  return made(s, rest_of(s, fraction, local_ns));
}

/* Local minus origin, modulo 2^64. */
static int64_t ahead_of(const ftcs_addend_sample* in) {
  const int32_t fraction = (int32_t)in->local_fraction - (int32_t)in->origin_fraction;
  const uint64_t ahead_ns = (uint64_t)in->local_ns - (uint64_t)in->origin_ns;
  return ftcs_addend_sum((int64_t)(ahead_ns << 16), fraction);
}

static void remember(ftcs_addend_servo* s, const ftcs_addend_sample* in) {
  const uint16_t origin_fraction = in->origin_fraction;
  const uint16_t local_fraction = in->local_fraction;
  s->origin_ns = in->origin_ns;
  s->local_ns = in->local_ns;
  s->origin_fraction = origin_fraction;
  s->local_fraction = local_fraction;
}

/* The history begins here: a correction that is under way goes on. */
void ftcs_addend_prime(ftcs_addend_servo* servo, const ftcs_addend_sample* sample) {
  if (servo->phase == FTCS_EMPTY) {
    const int64_t local_ns = sample->local_ns;
    if (local_ns < servo->start_ns) servo->until_ns = local_ns;
    servo->start_ns = local_ns;
    servo->phase = FTCS_PRIMED;
    remember(servo, sample);
    servo->expected = ahead_of(sample);
    if (local_ns < servo->until_ns) {
      servo->expected = ftcs_addend_less(
          servo->expected, made(servo, rest_of(servo, sample->local_fraction, local_ns)));
    }
  }
}

/* ---- one sample ---- */

typedef struct {
  int64_t ahead;      /* local minus origin, modulo 2^64: at the sample, later when it is written */
  int64_t faster;     /* what the reference gained on the clock at W(n) */
  int64_t waited;     /* from the sample to the writing: in time at W(n), later at W(n+1) */
  int64_t time;       /* [T_sync], later [T_c] */
  int64_t wanted_q16; /* W(n+1), not limited, not rounded */
  uint32_t wanted;    /* rounded */
} progress;

static int64_t rounded(int64_t addend_q16) { return addend_q16 >> 16; }

/* 37 minutes, or negative. */
static int32_t too_long(int64_t time_ns) { return (uint64_t)time_ns >> 41 != 0U ? 1 : 0; }

static int32_t outside(int64_t addend, uint32_t least, uint32_t most) {
  const uint32_t low = (uint32_t)addend;
  return (uint32_t)((uint64_t)addend >> 32) != 0U || low < least || low > most ? 1 : 0;
}

/* What the reference and the clock did since the last sample, and the clock will have done when
 * the registers are written. Returns an enum ftcs_addend_verdict. */
static int32_t compare(ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p,
                       int64_t* reference) {
  const int64_t since_ns = ftcs_addend_less(in->origin_ns, s->origin_ns);
  const int64_t waited_ns = ftcs_addend_less(in->now_ns, in->local_ns);
  if (in->local_ns <= s->start_ns) {
    if (in->local_ns > s->local_ns) return FTCS_ADDEND_STALE;
    return since_ns <= 0 ? FTCS_ADDEND_DUPLICATE : FTCS_ADDEND_IMPLAUSIBLE;
  }
  if (too_long(since_ns) != 0 || too_long(ftcs_addend_sum(waited_ns, FTCS_LONGEST_NS / 2)) != 0) {
    return FTCS_ADDEND_IMPLAUSIBLE;
  }
  *reference = since_ns * 65536 + ((int32_t)in->origin_fraction - (int32_t)s->origin_fraction);
  p->waited = waited_ns * 65536 - in->local_fraction;
  p->faster = ftcs_addend_less(s->expected, p->ahead);
  p->ahead = ftcs_addend_sum(p->ahead, p->waited);
  if (in->local_ns < s->until_ns) { /* C goes on. */
    const int64_t rest = rest_of(s, in->local_fraction, in->local_ns);
    const int64_t bend = made(s, rest);
    p->faster = ftcs_addend_sum(p->faster, bend);
    p->waited = ftcs_addend_sum(p->waited, p->waited < rest ? made(s, p->waited) : bend);
  }
  return FTCS_ADDEND_USED;
}

/* [T_sync] Of the last two gaps the shorter: a missing message does not make the interval longer.
 * What the clock gathered in an outage is an offset to be removed as at the start. */
static int64_t interval_of(ftcs_addend_servo* s, int64_t reference) {
  const int64_t interval = ftcs_addend_interval(s, reference);
  if (reference >> 2 > interval) {
    s->phase = FTCS_PRIMED;
    s->inside = 0;
  }
  s->interval = reference;
  return interval;
}

/* The rate that tracks. Returns an enum ftcs_addend_verdict. */
static int32_t track(ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p) {
  int64_t reference;
  int64_t shown;
  int64_t wanted;
  ftcs_addend_ratio rate;
  const int32_t verdict = compare(s, in, p, &reference);
  if (verdict != FTCS_ADDEND_USED) return verdict;
  shown = ftcs_addend_less(reference, p->faster);
  if (shown <= 0 || shown > 2 * FTCS_LONGEST) return FTCS_ADDEND_IMPLAUSIBLE;
  if (ftcs_addend_filter_of(s->config) != NULL) {
    int64_t filtered = p->faster;
    if (ftcs_addend_filter_of(s->config)(s, shown, &filtered) == 0) return FTCS_ADDEND_REJECTED;
    p->faster = filtered;
  }
  p->time = interval_of(s, reference);
  rate = ftcs_addend_divide(p->faster, shown);
  p->waited = ftcs_addend_sum(p->waited, ftcs_addend_times(rate, p->waited));
  p->wanted_q16 = (int64_t)((uint64_t)s->addend << 16 | 32768U) + ftcs_addend_of(rate, s->addend);
  wanted = rounded(p->wanted_q16);
  p->wanted = (uint32_t)wanted;
  return outside(wanted, s->lowest, s->highest) != 0 ? FTCS_ADDEND_IMPLAUSIBLE : FTCS_ADDEND_USED;
}

/* x part / 2^16 */
static int64_t part_of(int64_t x, uint32_t part_q16) {
  const int32_t upper = (int32_t)(uint32_t)((uint64_t)x >> 32);
  const int64_t whole = ftcs_addend_signed_product(upper, (int32_t)part_q16);
  return (int64_t)(((uint64_t)whole << 16) + (ftcs_addend_product((uint32_t)x, part_q16) >> 16));
}

/* The part of the offset that this correction removes: p inside the band, with hysteresis, after
 * `dwell` offsets inside it in a row (Table 1). */
static int64_t part_to_remove(ftcs_addend_servo* s, const ftcs_addend_config* c, int64_t offset,
                              uint32_t size_ns) {
  const uint32_t dwell = c->dwell > 0U ? c->dwell : 1U;
  uint32_t inside = s->inside;
  if (size_ns >= (inside >= dwell ? c->band_leave_ns : c->band_enter_ns)) {
    inside = 0;
  } else if (inside < dwell) {
    ++inside;
  } else {
    /* enough */
  }
  s->inside = (uint16_t)inside;
  return inside >= dwell ? part_of(offset, c->gain_q16) : offset;
}

/* Lock, deviation. */
static void watch(ftcs_addend_servo* s, const ftcs_addend_config* c, uint32_t size) {
  if (size >> 4 < c->lock_enter_ns) s->locked = 1;
  if (size >> 4 >= c->lock_leave_ns) s->locked = 0;
  if (ftcs_addend_filter_of(c) == NULL) s->deviation = ftcs_addend_average(s->deviation, size);
}

/* What of an offset is removed in T_c. */
static int64_t removed_of(ftcs_addend_servo* s, const ftcs_addend_config* c, int64_t offset) {
  const uint32_t size = ftcs_addend_size(offset);
  if (s->phase == FTCS_ACTING) watch(s, c, size);
  if (s->phase == FTCS_ACTING || c->dwell == 0U) return part_to_remove(s, c, offset, size >> 4);
  return offset;
}

/* The tracking addend takes effect. Returns whether F limits it. */
static int32_t follow(ftcs_addend_servo* s, progress* p) {
  s->addend = p->wanted;
  s->fraction = (int32_t)(uint16_t)p->wanted_q16 - 32768;
  if (outside(p->wanted, s->slowest, s->fastest) == 0) return 0;
  s->addend = p->wanted < s->slowest ? s->slowest : s->fastest;
  s->fraction = 0;
  p->ahead = ftcs_addend_sum(
      p->ahead, -ftcs_addend_times(ftcs_addend_change(s->addend, p->wanted), p->waited));
  return 1;
}

/* C for T_c, in which the clock shows `removed` less; from start_ns on. */
static void correct(ftcs_addend_servo* s, const progress* p, int64_t removed, int32_t limits) {
  const int64_t bent = p->wanted_q16 - ftcs_addend_of(s->bend, p->wanted);
  const int64_t correction = rounded(bent);
  /* What W's fraction made until start_ns. */
  int64_t beside = -ftcs_addend_signed_product((int32_t)(p->waited >> 21), s->fraction);
  int64_t length;
  s->correction = (uint32_t)correction;
  s->near = (uint32_t)((uint64_t)p->time >> 32);
  if (outside(correction, s->slowest, s->fastest) == 0) {
    s->phase = FTCS_ACTING;
  } else {
    limits = 1;
    s->correction = correction < (int64_t)s->slowest ? s->slowest : s->fastest;
    removed = -ftcs_addend_times(ftcs_addend_change(s->correction, s->addend), p->time);
  }
  length = p->time - removed + 32768;
  s->until_ns = ftcs_addend_sum(s->start_ns, length >> 16);
  if (limits != 0 || (uint32_t)s->bend < 17U) {
    s->bend = ftcs_addend_change(s->addend, s->correction);
    s->near = UINT32_MAX;
    removed = ftcs_addend_times(s->bend, length & ~(int64_t)65535);
  } else {
    /* Below 69 s and 30 ppm: `removed` it is, but for what both addends are rounded by. */
    beside += ftcs_addend_signed_product((int32_t)(p->time >> 21),
                                         (int32_t)(uint16_t)bent - 32768 - s->fraction);
  }
  removed += (int32_t)(beside >> 16) / (int32_t)((s->addend >> 21) + 1U);
  s->expected = ftcs_addend_less(p->ahead, removed);
}

static void steer(ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p,
                  ftcs_addend_command* out) {
  const ftcs_addend_config* c = s->config;
  int64_t removed;
  int32_t limits;
  p->ahead = ftcs_addend_less(p->ahead, p->waited);
  removed = ftcs_addend_less(p->ahead, in->path_delay_scaled);
  if (ftcs_addend_filter_of(c) != NULL) removed = ftcs_addend_less(removed, s->residue);
  if (c->correction_ns != 0) p->time = c->correction_ns * 65536;
  s->start_ns = in->now_ns;
  removed = removed_of(s, c, removed);
  limits = follow(s, p);
  if (ftcs_addend_timed(c) != 0) {
    p->time = p->waited < p->time >> 1 ? p->time - p->waited : p->time >> 1;
    limits |= (int32_t)(p->time >> 52); /* 69 s: too long for what is near enough */
  }
  s->bend = ftcs_addend_divide(removed, p->time);
  correct(s, p, removed, limits);
  out->addend = s->correction;
  out->until_ns = ftcs_addend_timed(c) != 0 ? s->until_ns : INT64_MAX;
}

/* Local minus reference. */
static int64_t offset_ns_of(const ftcs_addend_sample* in) {
  const int32_t fraction = (int32_t)in->origin_fraction - (int32_t)in->local_fraction;
  const int64_t later = ftcs_addend_sum(in->path_delay_scaled, (int64_t)fraction + 32768) >> 16;
  return (int64_t)((uint64_t)in->local_ns - (uint64_t)in->origin_ns - (uint64_t)later);
}

/* The first action steps the clock by whole nanoseconds; what that leaves is removed as any offset.
 */
static int32_t far(const ftcs_addend_servo* s, int64_t offset_ns) {
  const uint64_t size = offset_ns < 0 ? 0U - (uint64_t)offset_ns : (uint64_t)offset_ns;
  return s->phase != FTCS_ACTING && size >= s->config->step_ns ? 1 : 0;
}

void ftcs_addend_take(ftcs_addend_servo* servo, const ftcs_addend_sample* sample,
                      ftcs_addend_command* out) {
  int32_t verdict = FTCS_ADDEND_IMPLAUSIBLE;
  progress p;
  p.ahead = ahead_of(sample);
  out->offset_ns = offset_ns_of(sample);
  out->step_ns = 0;
  out->until_ns = 0;
  if (ftcs_addend_timed(servo->config) == 0) ftcs_addend_hold(servo, sample->now_ns);
  if (servo->phase != FTCS_EMPTY) verdict = track(servo, sample, &p);
  if (verdict == FTCS_ADDEND_USED) {
    ftcs_addend_sample after;
    const ftcs_addend_sample* in = sample;
    if (ftcs_addend_steps(servo->config) != 0 && far(servo, out->offset_ns) != 0) {
      out->step_ns = ftcs_addend_less(0, out->offset_ns);
      p.ahead = ftcs_addend_sum(p.ahead, (int64_t)((uint64_t)out->step_ns << 16));
      after = *sample;
      after.local_ns = ftcs_addend_sum(after.local_ns, out->step_ns);
      after.now_ns = ftcs_addend_sum(after.now_ns, out->step_ns);
      in = &after;
    }
    remember(servo, in);
    steer(servo, in, &p, out);
    out->act = 1;
    out->state = (int32_t)FTCS_ADDEND_ACQUIRING + servo->locked;
  } else {
    if (verdict == FTCS_ADDEND_IMPLAUSIBLE) {
      /* Which of the two samples is wrong cannot be known: again from the newer one. */
      if (servo->phase == FTCS_EMPTY) verdict = FTCS_ADDEND_USED;
      ftcs_addend_reset(servo);
      ftcs_addend_prime(servo, sample);
    }
    out->act = 0;
    out->addend = servo->addend;
    out->state = ftcs_addend_state_of(servo);
  }
  out->verdict = verdict;
  out->next_addend = servo->addend;
  /* 5/4: from the mean of magnitudes to the standard deviation of a normal distribution,
   * sqrt(pi / 2). */
  out->deviation_ns = servo->deviation / 64U * 5U;
}
