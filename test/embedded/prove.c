/* SPDX-License-Identifier: MIT */
/* For CBMC: the arithmetic of the servo for every operand in its stated range. No overflow, no
 * shift out of range, no division by zero; and whatever a servo holds and is fed, no addend beyond
 * F. Products of two unknown words are beyond a solver: instead of each any product of two words is
 * taken, for which more can go wrong. The reciprocal test/embedded/reciprocal.c checks for every
 * divisor. */
#include <stdint.h>

int64_t nondet_64(void);
uint64_t nondet_unsigned64(void);
uint32_t nondet_32(void);
uint16_t nondet_16(void);

#include "../../embedded/ftcs_addend_private.h"

static uint64_t any_product(void) {
  const uint64_t product = nondet_unsigned64();
  __CPROVER_assume(product <= UINT64_C(0xFFFFFFFE00000001));
  return product;
}
static int64_t any_signed_product(void) {
  const int64_t product = nondet_64();
  __CPROVER_assume(product >= -(INT64_C(1) << 62) && product <= INT64_C(1) << 62);
  return product;
}
#define ftcs_addend_product(a, b) any_product()
#define ftcs_addend_signed_product(a, b) any_signed_product()
#define ftcs_addend_mixed_product(a, b) nondet_64()

#include "../../embedded/ftcs_addend.c"
#include "../../embedded/ftcs_addend_actuator.c"
#include "../../embedded/ftcs_addend_arithmetic.c"
#include "../../embedded/ftcs_addend_quiet.c"

void prove_divide(void) {
  const int64_t n = nondet_64();
  const int64_t d = nondet_64();
  ftcs_addend_ratio r;
  __CPROVER_assume(d > 0 && d < (INT64_C(1) << 61));
  r = ftcs_addend_divide(n, d);
  __CPROVER_assert((uint32_t)r <= 31U, "a shift that times() can do");
  __CPROVER_assert(r >> 32 >= -INT32_MAX, "a mantissa that can be negated");
}

void prove_times(void) {
  const ftcs_addend_ratio r = nondet_64();
  __CPROVER_assume((uint32_t)r <= 31U);
  (void)ftcs_addend_times(r, nondet_64());
  (void)ftcs_addend_of(r, nondet_32());
}

void prove_difference(void) {
  const int64_t d = ftcs_addend_difference(nondet_64(), nondet_64());
  __CPROVER_assert(d <= FTCS_LONGEST && d >= -FTCS_LONGEST, "cut");
}

void prove_size(void) { (void)ftcs_addend_size(nondet_64()); }

/* Whatever the servo holds and is fed, no addend leaves nominal (1 +- F). */
void prove_limits(void) {
  ftcs_addend_config config;
  ftcs_addend_servo any;
  ftcs_addend_sample sample;
  ftcs_addend_command command;
  const uint32_t slowest = nondet_32();
  const uint32_t fastest = nondet_32();
  config.filter = NULL;
  any.config = &config;
  any.slowest = slowest;
  any.fastest = fastest;
  any.addend = nondet_32();
  __CPROVER_assume(any.addend >= slowest && any.addend <= fastest);
  ftcs_addend_take(&any, &sample, &command);
  __CPROVER_assert(command.addend >= slowest && command.addend <= fastest, "addend within F");
  __CPROVER_assert(command.next_addend >= slowest && command.next_addend <= fastest,
                   "next addend within F");
}
