/* SPDX-License-Identifier: MIT */
/* A clock on a processor that has nothing but a free-running timer: the addend is a factor in
 * memory, and the end of a correction is worked out when somebody asks for the time, so that no
 * interrupt is needed. Ask at least once in 2^32 ticks. Run by embedded_bare_metal_test and, as
 * part of a PTP node on a Cortex-M4 in QEMU, in much the same form by test/embedded/node.cpp. */
#include "bare_metal.h"

#include "ftcs_addend.h"

#define TICK_NS 40U /* 25 MHz */
#define NOMINAL (1U << 31)

static const ftcs_addend_config config = {
    .nominal_addend = NOMINAL,
    .limit_ppm = 100000,
    .plausible_ppm = 100000,
    .gain_q16 = 65536,
    .band_enter_ns = FTCS_ADDEND_UNBOUNDED,
    .band_leave_ns = FTCS_ADDEND_UNBOUNDED,
    .lock_enter_ns = 1000,
    .lock_leave_ns = 5000,
    .step_ns = 1000000,
    .dwell = 1,
    .filter = ftcs_addend_quiet,
    .quiet_memory = 64,
};
static ftcs_addend_servo servo;

static uint32_t last_ticks;
static int64_t shown_ns;  /* at last_ticks, */
static uint64_t fraction; /* and 2^-31 ns */
static uint32_t addend = NOMINAL;
static uint32_t next_addend = NOMINAL;
static int64_t until_ns = INT64_MAX;

int32_t bare_clock_start(int64_t now_ns) {
  last_ticks = timer_ticks();
  shown_ns = now_ns;
  return ftcs_addend_init(&servo, &config, NOMINAL);
}

/* `ticks` of the timer at the present addend. */
static void move_on(uint32_t ticks) {
  const uint64_t product = (uint64_t)ticks * addend; /* of a tick, 2^-31 */
  const uint64_t part = (product & (NOMINAL - 1U)) * TICK_NS + fraction;
  shown_ns += (int64_t)((product >> 31) * TICK_NS + (part >> 31));
  fraction = part & (NOMINAL - 1U);
}

int64_t bare_clock_now(void) {
  const uint32_t ticks = timer_ticks();
  uint32_t elapsed = ticks - last_ticks;
  if (until_ns != INT64_MAX) {
    /* Ticks until the correction ends, rounded up. */
    const uint64_t left = until_ns > shown_ns ? (uint64_t)(until_ns - shown_ns) : 0U;
    const uint64_t to_end = (left / TICK_NS + 1U) * NOMINAL / addend;
    if (to_end <= elapsed) {
      move_on((uint32_t)to_end);
      elapsed -= (uint32_t)to_end;
      ftcs_addend_wrote_next(&servo, shown_ns);
      addend = next_addend;
      until_ns = INT64_MAX;
    }
  }
  move_on(elapsed);
  last_ticks = ticks;
  return shown_ns;
}

int32_t bare_clock_sync(int64_t origin_ns, int64_t receive_ns, int64_t path_delay_scaled) {
  const ftcs_addend_sample sample = {origin_ns,         receive_ns, bare_clock_now(),
                                     path_delay_scaled, 0,          0};
  ftcs_addend_command command;
  ftcs_addend_take(&servo, &sample, &command);
  if (command.act != 0) {
    shown_ns += command.step_ns;
    addend = command.addend;
    next_addend = command.next_addend;
    until_ns = command.until_ns;
  }
  return command.state;
}
