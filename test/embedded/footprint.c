/* SPDX-License-Identifier: MIT */
/* The smallest program that uses the servo: what of the library the linker keeps. */
#include "ftcs_addend.h"

#ifndef START
#define START ftcs_addend_start
#endif

static const ftcs_addend_config config = {.nominal_addend = 0x4C30C30C,
                                          .limit_ppm = 100000,
                                          .plausible_ppm = 100000,
                                          .gain_q16 = 4096,
                                          .band_enter_ns = FTCS_ADDEND_UNBOUNDED,
                                          .band_leave_ns = FTCS_ADDEND_UNBOUNDED,
                                          .lock_enter_ns = 1000,
                                          .lock_leave_ns = 5000,
                                          .dwell = 1};
static ftcs_addend_servo servo;
typedef char fits[sizeof(ftcs_addend_servo) <= 128U ? 1 : -1];

volatile ftcs_addend_sample stamps;
volatile uint32_t addend_register;

#ifdef NOTHING
int main(void) { return (int)sizeof(fits) - 1; }
#else
int main(void) {
  (void)START(&servo, &config, config.nominal_addend);
  for (;;) {
    const ftcs_addend_sample sample = stamps;
    ftcs_addend_command command;
    ftcs_addend_take(&servo, &sample, &command);
    addend_register = command.addend;
  }
}
#endif
