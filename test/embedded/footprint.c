/* SPDX-License-Identifier: MIT */
/* The smallest program that uses the servo: what of the library the linker keeps. */
#include "ftcs_addend.h"

static const ftcs_addend_config config = {0x4C30C30C,
                                          100000,
                                          100000,
                                          4096,
                                          FTCS_ADDEND_UNBOUNDED,
                                          FTCS_ADDEND_UNBOUNDED,
                                          1000,
                                          5000,
                                          0,
                                          0,
                                          0,
                                          1,
                                          0,
                                          0};
static ftcs_addend_servo servo;
/* At most so much memory, with and without quiet mode. */
#ifdef FTCS_ADDEND_WITHOUT_QUIET
typedef char fits[sizeof(ftcs_addend_servo) <= 128U ? 1 : -1];
#else
typedef char fits[sizeof(ftcs_addend_servo) <= 192U ? 1 : -1];
#endif

volatile ftcs_addend_sample stamps;
volatile uint32_t addend_register;

int main(void) {
  const int32_t error = ftcs_addend_init(&servo, &config, config.nominal_addend);
  const ftcs_addend_sample sample = stamps;
  const ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
  addend_register = command.addend;
  return (int)(error + (int32_t)sizeof(fits) - 1);
}
