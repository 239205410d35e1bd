/* SPDX-License-Identifier: MIT */
/* LinuxCNC's way: the task cannot choose its next wake-up, it can only lengthen or shorten the next period
 * (rtapi_task_pll_get_reference() and rtapi_task_pll_set_correction()). A simulated task calls
 * correction_of() as a driver's read function would; frames come back a cycle later.
 *
 *   task_pll_cycle            exit code 1: not locked */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "ftcs/discipline/ftcs_cycle_servo.h"

typedef struct driver {
  ftcs_cycle_servo servo;
  ftcs_cycle_sample in_flight; /* frame of the cycle before */
  ftcs_cycle_decision decision;
  int64_t reference_ns; /* last latch, 64 bits */
} driver;

/* Called when the task woke up. `wake_ns`: rtapi_task_pll_get_reference(); `latch`: what the last frame
 * brought back, NULL if it was lost. Returns what rtapi_task_pll_set_correction() takes. */
static int64_t correction_of(driver* d, int64_t wake_ns, int64_t now_ns, const uint32_t* latch,
                             int64_t period_ns) {
  d->in_flight.has_reference = latch != NULL;
  if (latch != NULL) {
    d->reference_ns = ftcs_cycle_unwrap(d->reference_ns, *latch);
    d->in_flight.reference_ns = d->reference_ns;
  }
  d->decision = ftcs_cycle_update(&d->servo, &d->in_flight, now_ns);
  return d->decision.wake_ns - (wake_ns + period_ns);
}

/* Called right before the driver's write function sends the frame. */
static void sending(driver* d, int64_t wake_ns, int64_t now_ns) {
  d->in_flight.has_scheduled = 1;
  d->in_flight.scheduled_ns = wake_ns;
  d->in_flight.sent_ns = now_ns;
}

/* --- the simulated rest: a reference 80 ppm slow, a task that wakes up 10 to 60 us late --- */

static int64_t reference_at(int64_t host_ns) { return 123456789 + host_ns - host_ns / 12500; }

int main(void) {
  static driver d;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  const int64_t period_ns = 1000000;
  int64_t wake_ns = 5000000;
  int64_t largest = 0;
  uint32_t latch = 0;
  int cycle, locked_at = -1;
  config.law = FTCS_CYCLE_ADAPTIVE;
  config.cycle_ns = period_ns;
  if (ftcs_cycle_init(&d.servo, sizeof d.servo, &config) != FTCS_CYCLE_OK) return 1;
  ftcs_cycle_start(&d.servo, wake_ns - period_ns); /* asks for the wake-up that the task has */
  for (cycle = 1; cycle <= 2000; ++cycle) {
    const int64_t now_ns = wake_ns + 10000 + (cycle * 7919) % 50000;
    const int came_back = cycle > 1 && cycle % 50 != 0;
    const int64_t correction =
        correction_of(&d, wake_ns, now_ns, came_back ? &latch : NULL, period_ns);
    sending(&d, wake_ns, now_ns + 15000);
    latch = (uint32_t)reference_at(now_ns + 15000);
    if (d.decision.state == FTCS_CYCLE_LOCKED && locked_at < 0) locked_at = cycle;
    if (locked_at >= 0 && llabs(correction) > largest) largest = llabs(correction);
    wake_ns += period_ns + correction;
  }
  printf("%s after %d cycles; rate %+.3f ppm (true -80); correction then at most %lld ns a period\n",
         ftcs_cycle_state_name(d.decision.state), locked_at, d.decision.rate_ppb * 1e-3,
         (long long)largest);
  return d.decision.state == FTCS_CYCLE_LOCKED ? EXIT_SUCCESS : EXIT_FAILURE;
}
