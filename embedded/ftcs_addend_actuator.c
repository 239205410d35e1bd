/* SPDX-License-Identifier: MIT */
#include "ftcs_addend_private.h"

/* What the registers really did, and what a program asks: not needed where a command is obeyed as
 * it is. */

ftcs_addend_config ftcs_addend_default_config(uint32_t nominal_addend) {
  ftcs_addend_config c = {0};
  const uint32_t above = UINT32_MAX - nominal_addend;
  c.nominal_addend = nominal_addend;
  c.limit_ppm = 500000;
  if (above < nominal_addend / 2U) {
    c.limit_ppm =
        (uint32_t)(ftcs_addend_times(ftcs_addend_divide(above, nominal_addend), 1000000 << 8) >> 8);
  }
  c.plausible_ppm = c.limit_ppm;
  c.gain_q16 = 4096;
  c.band_enter_ns = FTCS_ADDEND_UNBOUNDED;
  c.band_leave_ns = FTCS_ADDEND_UNBOUNDED;
  c.lock_enter_ns = 1000;
  c.lock_leave_ns = 5000;
  c.dwell = 1;
  return c;
}

int32_t ftcs_addend_init(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                         uint32_t addend_now) {
  const ftcs_addend_config* c = config;
  const uint32_t nominal = config->nominal_addend;
  int32_t error = FTCS_ADDEND_OK;
  ftcs_addend_start(servo, c, addend_now);
  if (addend_now - servo->slowest > servo->fastest - servo->slowest) {
    error = FTCS_ADDEND_BAD_ADDEND;
  }
  /* Zero; or a limit that does not fit 32 bits, and has wrapped. */
  if (nominal - 1U >= servo->fastest) error = FTCS_ADDEND_BAD_NOMINAL;
  if (nominal - 1U >= servo->highest) error = FTCS_ADDEND_BAD_NOMINAL;
  if (c->limit_ppm - 1U >= 500000U) error = FTCS_ADDEND_BAD_LIMIT;
  if (c->plausible_ppm - 1U >= 500000U) error = FTCS_ADDEND_BAD_LIMIT;
  if (c->gain_q16 > 65536U) error = FTCS_ADDEND_BAD_GAIN;
  if (c->band_leave_ns < c->band_enter_ns) error = FTCS_ADDEND_BAD_BAND;
  if (c->lock_leave_ns < c->lock_enter_ns) error = FTCS_ADDEND_BAD_BAND;
  if (c->interval_ns != 0 && c->correction_ns > c->interval_ns) error = FTCS_ADDEND_BAD_TIME;
  if ((uint64_t)(c->interval_ns | c->correction_ns) >> 41 != 0U) error = FTCS_ADDEND_BAD_TIME;
#if FTCS_OPTIONS
  if (c->step_ns >> 28 != 0U) error = FTCS_ADDEND_BAD_TIME;
  if (c->filter != NULL && c->quiet_memory - 8U > 247U) error = FTCS_ADDEND_BAD_MEMORY;
#else
  if ((c->step_ns | c->no_timer) != 0U) error = FTCS_ADDEND_BAD_OPTION;
  if (c->filter != NULL) error = FTCS_ADDEND_BAD_OPTION;
#endif
  return error;
}

/* In units of addends, as everything that a register can hold is limited by F. */
static uint32_t cut(const ftcs_addend_servo* s, uint32_t addend) {
  return addend < s->slowest ? s->slowest : (addend > s->fastest ? s->fastest : addend);
}

/* At W, from the last sample to a reading. */
int64_t ftcs_addend_elapsed(const ftcs_addend_servo* servo, int64_t local_ns) {
  int64_t since = ftcs_addend_difference(local_ns, servo->local_ns) - servo->local_fraction;
  if (local_ns >= servo->start_ns) {
    /* Local minus origin as it was, less what it will be if the oscillator stays as it is. */
    const int32_t fraction = (int32_t)servo->local_fraction - (int32_t)servo->origin_fraction;
    const uint64_t ahead_ns = (uint64_t)servo->local_ns - (uint64_t)servo->origin_ns;
    const int64_t gained = ftcs_addend_sum((int64_t)(ahead_ns << 16), fraction);
    since = ftcs_addend_sum(since, gained);
    since = ftcs_addend_less(since, servo->expected);
    since = ftcs_addend_less(since, ftcs_addend_bend(servo, 0, local_ns));
  }
  return since;
}

void ftcs_addend_wrote(ftcs_addend_servo* servo, int64_t at_ns, uint32_t addend,
                       uint32_t next_addend) {
  if (servo->interval != 0) {
    const uint32_t was = servo->addend;
    const int64_t planned =
        ftcs_addend_difference(servo->start_ns, servo->local_ns) - servo->local_fraction;
    const int64_t late = ftcs_addend_clamp(ftcs_addend_difference(at_ns, servo->start_ns),
                                           -(planned >> 1), FTCS_LONGEST_LATENCY);
    int64_t before = ftcs_addend_elapsed(servo, servo->start_ns);
    /* What the clock showed until then, and a constant. */
    int64_t shown = ftcs_addend_sum(servo->expected, before);
    shown = ftcs_addend_sum(shown, ftcs_addend_bend(servo, 0, servo->start_ns) + late);
    /* It went on as it had from the sample to start_ns, near enough. */
    if (planned > 0) {
      const ftcs_addend_ratio faster =
          ftcs_addend_divide(ftcs_addend_less(before, planned), planned);
      before = ftcs_addend_sum(before, ftcs_addend_times(faster, late));
    }
    before = ftcs_addend_sum(before, late);
    servo->addend = cut(servo, next_addend);
    servo->fraction = (int32_t)ftcs_addend_clamp(
        servo->fraction + ((int64_t)was - (int64_t)servo->addend) * 65536, -INT32_MAX, INT32_MAX);
    before =
        ftcs_addend_sum(before, ftcs_addend_times(ftcs_addend_change(servo->addend, was), before));
    servo->correction = cut(servo, addend);
    servo->bend = ftcs_addend_change(servo->addend, servo->correction);
    servo->near = UINT32_MAX;
    servo->start_ns = ftcs_addend_sum(servo->start_ns, late >> 16);
    if (servo->start_ns >= servo->until_ns) servo->phase = FTCS_PRIMED; /* it was never made */
    shown = ftcs_addend_less(shown, ftcs_addend_bend(servo, 0, servo->start_ns));
    servo->expected = ftcs_addend_less(shown, before);
  }
}

void ftcs_addend_wrote_next(ftcs_addend_servo* servo, int64_t at_ns) {
  if (ftcs_addend_timed(servo->config) != 0) ftcs_addend_hold(servo, at_ns);
}

void ftcs_addend_stepped(ftcs_addend_servo* servo, int64_t by_ns) {
  servo->local_ns = ftcs_addend_sum(servo->local_ns, by_ns);
  servo->start_ns = ftcs_addend_sum(servo->start_ns, by_ns);
  servo->until_ns = ftcs_addend_sum(servo->until_ns, by_ns);
  servo->expected = ftcs_addend_sum(servo->expected, (int64_t)((uint64_t)by_ns << 16));
}

int32_t ftcs_addend_state_at(const ftcs_addend_servo* servo, int64_t now_ns) {
  const int64_t silence = ftcs_addend_difference(now_ns, servo->local_ns);
  const int64_t interval = ftcs_addend_interval(servo, servo->interval);
  const int32_t coasting = servo->interval > 0 && silence >> 2 > interval ? 1 : 0;
  return coasting != 0 ? (int32_t)FTCS_ADDEND_COASTING : ftcs_addend_state_of(servo);
}

int32_t ftcs_addend_rate_ppb(const ftcs_addend_servo* servo) {
  const int64_t nominal = servo->config->nominal_addend;
  return (int32_t)(((int64_t)servo->addend - nominal) * 1000000000 / nominal);
}

const char* ftcs_addend_state_name(int32_t state) {
  static const char* const names[4] = {"waiting", "acquiring", "locked", "coasting"};
  return state >= 0 && state < 4 ? names[state] : "?";
}
