/* SPDX-License-Identifier: MIT */
#include "ftcs_addend_private.h"

/* nominal (1 + ppm / 10^6) */
int64_t ftcs_addend_beyond(uint32_t nominal, uint32_t ppm) {
  const int64_t addend = (int64_t)nominal << 16;
  return (addend + ftcs_addend_times(addend, ftcs_addend_divide(ppm, 1000000))) >> 16;
}

void ftcs_addend_start(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                       uint32_t addend_now) {
  static const ftcs_addend_servo nothing = {0};
  const uint32_t nominal = config->nominal_addend;
  *servo = nothing;
  servo->config = config;
  servo->fastest = (uint32_t)ftcs_addend_beyond(nominal, config->limit_ppm);
  servo->slowest = 2U * nominal - servo->fastest;
  servo->highest = (uint32_t)ftcs_addend_beyond(nominal, config->plausible_ppm);
  servo->lowest = 2U * nominal - servo->highest;
  servo->addend = addend_now;
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

int64_t ftcs_addend_tracking_time(const ftcs_addend_servo* s, int64_t local) {
  return local + ftcs_addend_times(local < s->length ? local : s->length, s->shortening);
}

static void remember(ftcs_addend_servo* s, const ftcs_addend_sample* in) {
  s->origin_ns = in->origin_ns;
  s->origin_fraction = in->origin_fraction;
  s->local_ns = in->local_ns;
  s->local_fraction = in->local_fraction;
}

/* The history begins here: a correction that is under way goes on. */
void ftcs_addend_prime(ftcs_addend_servo* servo, const ftcs_addend_sample* sample) {
  if (servo->phase == FTCS_EMPTY) {
    int64_t since = ftcs_addend_difference(sample->local_ns, servo->start_ns);
    remember(servo, sample);
    servo->phase = FTCS_PRIMED;
    if ((uint64_t)since >= (uint64_t)servo->length) { /* or before it */
      since = 0;
      servo->start_ns = sample->local_ns;
      servo->length = 0;
    }
    servo->before_start = -ftcs_addend_tracking_time(servo, since + sample->local_fraction);
  }
}

/* ---- one sample ---- */

typedef struct {
  int64_t since;          /* from start_ns to the sample, in time at W(n) */
  ftcs_addend_ratio rate; /* W(n+1) / W(n) - 1 */
  int64_t wanted_q16;     /* W(n+1), not rounded, not limited */
  int64_t interval;       /* [T_sync] */
  uint32_t size;          /* of the offset, 1/16 ns */
} progress;

/* Local minus reference, if the clock showed this when the sample was taken. */
static int64_t offset_at(const ftcs_addend_sample* in, int64_t local_ns, int32_t fraction) {
  return ftcs_addend_sum(
      ftcs_addend_difference(local_ns, in->origin_ns) + (fraction - (int32_t)in->origin_fraction),
      (int64_t)(0U - (uint64_t)in->path_delay_scaled));
}

/* The rate that tracks. Returns an enum ftcs_addend_verdict. */
static int32_t track(ftcs_addend_servo* s, const ftcs_addend_sample* in, progress* p) {
  const int64_t reference = ftcs_addend_difference(in->origin_ns, s->origin_ns) +
                            ((int32_t)in->origin_fraction - (int32_t)s->origin_fraction);
  int64_t shown;
  int64_t ahead;
  if (in->local_ns <= s->local_ns) {
    return reference <= 0 ? FTCS_ADDEND_DUPLICATE : FTCS_ADDEND_IMPLAUSIBLE;
  }
  if ((uint64_t)reference >= (uint64_t)FTCS_LONGEST) return FTCS_ADDEND_IMPLAUSIBLE;
  shown = ftcs_addend_difference(in->local_ns, s->start_ns) + in->local_fraction;
  if (shown < 0) return FTCS_ADDEND_STALE;
  p->since = ftcs_addend_tracking_time(s, shown);
  shown = s->before_start + p->since;
  if (shown <= 0) return FTCS_ADDEND_IMPLAUSIBLE;
  ahead = reference - shown;
  if (s->config->filter != NULL && s->config->filter(s, shown, &ahead) == 0) {
    return FTCS_ADDEND_REJECTED;
  }
  p->rate = ftcs_addend_divide(ahead, shown);
  p->wanted_q16 = (int64_t)s->addend << 16;
  p->wanted_q16 += ftcs_addend_times(p->wanted_q16, p->rate);
  p->interval = ftcs_addend_interval(s, reference);
  if (reference >> 2 > p->interval) {
    /* What the clock gathered in an outage is an offset to be removed as at the start. */
    s->phase = FTCS_PRIMED;
    s->inside = 0;
  }
  s->interval = reference;
  return ftcs_addend_limited(p->wanted_q16, s->lowest, s->highest) != p->wanted_q16
             ? FTCS_ADDEND_IMPLAUSIBLE
             : FTCS_ADDEND_USED;
}

/* The part of the offset that this correction removes: p inside the band, with hysteresis, after
 * `dwell` offsets inside it in a row (Table 1). */
static int64_t removed_part(ftcs_addend_servo* s, int64_t offset) {
  const ftcs_addend_config* c = s->config;
  const uint32_t dwell = c->dwell > 0U ? c->dwell : 1U;
  if (s->phase == FTCS_ACTING || c->dwell == 0U) {
    const uint32_t band = s->inside >= dwell ? c->band_leave_ns : c->band_enter_ns;
    if (ftcs_addend_size(offset) >> 4 >= band) {
      s->inside = 0;
    } else if (s->inside < dwell) {
      ++s->inside;
    } else {
      /* enough */
    }
    if (s->inside >= dwell) {
      return ftcs_addend_times(offset, (int64_t)((uint64_t)c->gain_q16 << 46 | 1U));
    }
  }
  return offset;
}

/* The first action may step: in whole nanoseconds, what that leaves is removed later. */
static int64_t step_of(ftcs_addend_servo* s, const ftcs_addend_sample* in, uint32_t size_ns) {
  int64_t step = 0;
  if (s->phase != FTCS_ACTING && s->config->step_ns != 0U && size_ns >= s->config->step_ns) {
    step = (int64_t)((uint64_t)in->origin_ns + (uint64_t)(in->path_delay_scaled >> 16) -
                     (uint64_t)in->local_ns);
    s->local_ns = ftcs_addend_sum(s->local_ns, step);
  }
  return step;
}

/* What the wanted rate gains on the written one, which is half a unit of an addend away at most. */
static int32_t gained(const ftcs_addend_servo* s, int64_t time) {
  return (int32_t)((int64_t)(int32_t)(time >> 21) * s->fraction >> 16) /
         (int32_t)((s->addend >> 21) + 1U);
}

/* The tracking addend takes effect. What has been waited, in time at W(n+1). */
static void follow(ftcs_addend_servo* s, const progress* p, int64_t at_old_rate, int64_t waited) {
  const int64_t tracking = ftcs_addend_limited(p->wanted_q16, s->slowest, s->fastest);
  const uint32_t addend = (uint32_t)((tracking + 32768) >> 16);
  s->fraction = (int16_t)(uint16_t)tracking;
  s->before_start = waited - gained(s, waited);
  if (tracking != p->wanted_q16) {
    s->before_start =
        at_old_rate + ftcs_addend_times(at_old_rate, ftcs_addend_change(addend, s->addend));
  }
  s->addend = addend;
}

static void steer(ftcs_addend_servo* s, const ftcs_addend_sample* in, const progress* p,
                  ftcs_addend_command* out) {
  const ftcs_addend_config* c = s->config;
  /* From the sample to the moment of writing. */
  const int64_t at_old_rate =
      ftcs_addend_tracking_time(s, ftcs_addend_difference(in->now_ns, s->start_ns)) - p->since;
  const int64_t waited = at_old_rate + ftcs_addend_times(at_old_rate, p->rate);
  int64_t time = c->correction_ns != 0 ? c->correction_ns * 65536 : p->interval;
  const int64_t least_time = time >> 1;
  int64_t removed;
  int64_t bent;
  int64_t correction;
  if (c->no_timer == 0U) time -= waited;
  if (time < least_time) time = least_time;
  out->step_ns = step_of(s, in, p->size >> 4);
  removed = 0;
  if (out->step_ns == 0) {
    removed =
        removed_part(s, ftcs_addend_sum(offset_at(in, in->now_ns, 0), -(s->residue + waited)));
  }
  follow(s, p, at_old_rate, waited);
  bent = p->wanted_q16 - ftcs_addend_times(p->wanted_q16, ftcs_addend_divide(removed, time));
  correction = ftcs_addend_limited(bent, s->slowest, s->fastest);
  out->addend = (uint32_t)((correction + 32768) >> 16);
  if (correction == bent) {
    s->phase = FTCS_ACTING;
  } else {
    removed = -ftcs_addend_times(time, ftcs_addend_change(out->addend, s->addend));
  }
  /* In T_c the clock shows p offset less. */
  ftcs_addend_plan(s, ftcs_addend_sum(in->now_ns, out->step_ns),
                   (time - removed + 32768) & ~(int64_t)65535, out->addend);
  out->until_ns = c->no_timer != 0U ? INT64_MAX : ftcs_addend_sum(s->start_ns, s->length >> 16);
  out->act = 1;
}

/* Lock, deviation. */
static void watch(ftcs_addend_servo* s, uint32_t size) {
  const ftcs_addend_config* c = s->config;
  if (s->phase != FTCS_ACTING) return;
  if (size >> 4 < c->lock_enter_ns) s->locked = 1;
  if (size >> 4 >= c->lock_leave_ns) s->locked = 0;
  if (c->filter == NULL) s->deviation = ftcs_addend_average(s->deviation, size);
}

void ftcs_addend_take(ftcs_addend_servo* servo, const ftcs_addend_sample* sample,
                      ftcs_addend_command* out) {
  const int64_t offset = offset_at(sample, sample->local_ns, sample->local_fraction);
  int32_t verdict = FTCS_ADDEND_USED;
  progress p;
  out->offset_ns = ftcs_addend_sum(offset, 32768) >> 16;
  out->act = 0;
  out->addend = servo->addend;
  out->until_ns = 0;
  out->step_ns = 0;
  if (servo->phase == FTCS_EMPTY) {
    ftcs_addend_prime(servo, sample);
  } else {
    verdict = track(servo, sample, &p);
    if (verdict == FTCS_ADDEND_IMPLAUSIBLE) {
      /* Which of the two samples is wrong cannot be known: again from the newer one. */
      ftcs_addend_reset(servo);
      ftcs_addend_prime(servo, sample);
    }
    if (verdict == FTCS_ADDEND_USED) {
      p.size = ftcs_addend_size(offset);
      watch(servo, p.size);
      remember(servo, sample);
      steer(servo, sample, &p, out);
    }
  }
  out->verdict = verdict;
  out->next_addend = servo->addend;
  out->state = ftcs_addend_state_of(servo);
  /* 5/4: from the mean of magnitudes to the standard deviation of a normal distribution, sqrt(pi /
   * 2). */
  out->deviation_ns = servo->deviation / 64U * 5U;
}
