/* SPDX-License-Identifier: MIT */
/* A project elsewhere: headers and library as they were installed. Locks to a clock 20 ppm fast. */
#include <stdio.h>

#include "ftcs/discipline/ftcs_cycle_servo.h"

int main(void) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_cycle_decision decision;
  int cycle;
#ifndef FTCS_CYCLE_WITHOUT_ADAPTIVE
  config.law = FTCS_CYCLE_ADAPTIVE;
#endif
  config.cycles_per_sync = 50;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return 1;
  decision = ftcs_cycle_start(&servo, 0);
  for (cycle = 0; cycle < 500; ++cycle) {
    ftcs_cycle_sample sample = {0};
    sample.has_reference = 1;
    sample.sent_ns = decision.wake_ns + 30000;
    sample.reference_ns = 5000123456LL + sample.sent_ns + sample.sent_ns / 50000;
    decision = ftcs_cycle_update(&servo, &sample, sample.sent_ns + 1000);
  }
  printf("%s, %.1f ppb\n", ftcs_cycle_state_name(decision.state), decision.rate_ppb);
  return decision.state == FTCS_CYCLE_LOCKED && decision.rate_ppb > 19900 && decision.rate_ppb < 20100 ? 0 : 1;
}
