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
        (uint32_t)(ftcs_addend_times(1000000 << 8, ftcs_addend_divide(above, nominal_addend)) >> 8);
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

static int32_t time_error(const ftcs_addend_config* c) {
  const uint64_t hour = UINT64_C(3600000000000);
  const uint64_t longest = c->interval_ns > 0 ? (uint64_t)c->interval_ns : hour;
  return (uint64_t)c->interval_ns > hour || (uint64_t)c->correction_ns > longest ||
                 c->step_ns >= UINT32_C(1) << 28
             ? FTCS_ADDEND_BAD_TIME
             : FTCS_ADDEND_OK;
}

static int32_t config_error(const ftcs_addend_config* c) {
  if (c->limit_ppm - 1U >= 500000U || c->plausible_ppm - 1U >= 500000U) {
    return FTCS_ADDEND_BAD_LIMIT;
  }
  if (c->gain_q16 > 65536U) return FTCS_ADDEND_BAD_GAIN;
  if (c->band_leave_ns < c->band_enter_ns || c->lock_leave_ns < c->lock_enter_ns) {
    return FTCS_ADDEND_BAD_BAND;
  }
  if (c->filter != NULL && c->quiet_memory - 8U > 247U) return FTCS_ADDEND_BAD_MEMORY;
  return time_error(c);
}

int32_t ftcs_addend_init(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                         uint32_t addend_now) {
  const int32_t error = config_error(config);
  const uint32_t nominal = config->nominal_addend;
  if (error != FTCS_ADDEND_OK) return error;
  if (nominal == 0U || ((ftcs_addend_beyond(nominal, config->limit_ppm) |
                         ftcs_addend_beyond(nominal, config->plausible_ppm)) >>
                        32) != 0) {
    return FTCS_ADDEND_BAD_NOMINAL;
  }
  ftcs_addend_start(servo, config, addend_now);
  return addend_now < servo->slowest || addend_now > servo->fastest ? FTCS_ADDEND_BAD_ADDEND
                                                                    : FTCS_ADDEND_OK;
}

/* In units of addends, as everything that a register can hold is limited by F. */
static uint32_t limited(const ftcs_addend_servo* s, uint32_t addend) {
  return addend < s->slowest ? s->slowest : (addend > s->fastest ? s->fastest : addend);
}

void ftcs_addend_wrote(ftcs_addend_servo* servo, int64_t at_ns, uint32_t addend,
                       uint32_t next_addend) {
  if (servo->interval != 0) {
    const uint32_t was = servo->addend;
    const int64_t planned =
        ftcs_addend_difference(servo->start_ns, servo->local_ns) - servo->local_fraction;
    const int64_t late = ftcs_addend_clamp(ftcs_addend_difference(at_ns, servo->start_ns),
                                           -(planned >> 1), FTCS_LONGEST_LATENCY);
    int64_t before = servo->before_start + late;
    /* The clock went on as it had from the sample to start_ns, near enough. */
    if (planned > 0) {
      before += ftcs_addend_times(late, ftcs_addend_divide(servo->before_start - planned, planned));
    }
    servo->addend = limited(servo, next_addend);
    servo->fraction = (int32_t)ftcs_addend_clamp(
        servo->fraction + ((int64_t)was - (int64_t)servo->addend) * 65536, -INT32_MAX, INT32_MAX);
    before += ftcs_addend_times(before, ftcs_addend_change(servo->addend, was));
    servo->before_start = ftcs_addend_clamp(before, -FTCS_LONGEST, FTCS_LONGEST);
    ftcs_addend_plan(servo, ftcs_addend_sum(servo->start_ns, late >> 16),
                     servo->length > late ? servo->length - late : 0, limited(servo, addend));
  }
}

void ftcs_addend_wrote_next(ftcs_addend_servo* servo, int64_t at_ns) {
  if (servo->config->no_timer == 0U) {
    servo->length =
        ftcs_addend_clamp(ftcs_addend_difference(at_ns, servo->start_ns), 0, FTCS_LONGEST);
  }
}

void ftcs_addend_stepped(ftcs_addend_servo* servo, int64_t by_ns) {
  servo->local_ns = ftcs_addend_sum(servo->local_ns, by_ns);
  servo->start_ns = ftcs_addend_sum(servo->start_ns, by_ns);
}

int64_t ftcs_addend_elapsed(const ftcs_addend_servo* servo, int64_t local_ns) {
  const int64_t since = ftcs_addend_difference(local_ns, servo->start_ns);
  if (since >= 0) return servo->before_start + ftcs_addend_tracking_time(servo, since);
  return ftcs_addend_difference(local_ns, servo->local_ns) - servo->local_fraction;
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
