/* SPDX-License-Identifier: MIT */
/* For CBMC: the arithmetic of the servo for every operand in its stated range. No overflow, no
 * shift out of range, no division by zero; a quotient is below what its divisor allows, a product
 * below its operand. */
#include "../../embedded/ftcs_addend.c"

int64_t nondet_64(void);
uint64_t nondet_unsigned64(void);
uint32_t nondet_32(void);
uint16_t nondet_16(void);

void prove_quotient(void) {
  const int64_t n = nondet_64();
  const int64_t d = nondet_64();
  ftcs_addend_ratio r;
  __CPROVER_assume(d > 0 && d < (INT64_C(1) << 61));
  __CPROVER_assume(n > -4 * d && n < 4 * d);
  r = quotient(n, d);
  __CPROVER_assert(r == 0 || ((r & 0xFFU) >= 29U && (r & 0xFFU) < 96U),
                   "a shift that times() can do");
}

void prove_digit(void) {
  uint32_t rest = nondet_32();
  const uint32_t d = nondet_32();
  __CPROVER_assume(d >= 0x80000000U && rest < d);
  {
    const uint32_t q = digit(&rest, d);
    __CPROVER_assert(q <= 0xFFFFU, "a digit of 16 bits");
    __CPROVER_assert(rest < d, "a rest below the divisor");
  }
}

void prove_times(void) {
  const int64_t x = nondet_64();
  const ftcs_addend_ratio r = nondet_unsigned64();
  __CPROVER_assume(x > -(INT64_C(1) << 61) && x < (INT64_C(1) << 61));
  __CPROVER_assume((r & 0xFFU) >= 32U && (r & 0xFFU) < 96U);
  (void)times(x, r);
}

void prove_difference(void) {
  const int64_t d = difference(nondet_64(), nondet_16(), nondet_64(), nondet_16());
  __CPROVER_assert(d <= FTCS_LONGEST + 65535 && d >= -FTCS_LONGEST - 65535, "cut");
}

void prove_shifted(void) { (void)shifted_ns(nondet_64(), nondet_64()); }

void prove_part_of(void) {
  const int64_t x = nondet_64();
  const uint32_t part = nondet_32();
  __CPROVER_assume(part <= 131072U && x > -(INT64_C(1) << 61) && x < (INT64_C(1) << 61));
  (void)part_of(x, part);
}

/* Whatever the servo holds and is fed, no addend leaves nominal (1 +- F), and a register that was
 * told is never zero. */
void prove_limits(void) {
  ftcs_addend_config config;
  ftcs_addend_servo servo;
  ftcs_addend_sample sample;
  ftcs_addend_command command;
  servo.config = &config;
  if (ftcs_addend_init(&servo, &config, nondet_32()) != FTCS_ADDEND_OK) return;
  {
    const uint32_t slowest = servo.slowest;
    const uint32_t fastest = servo.fastest;
    ftcs_addend_servo any;
    any.config = &config;
    any.slowest = slowest;
    any.fastest = fastest;
    any.addend = nondet_32();
    __CPROVER_assume(any.addend >= slowest && any.addend <= fastest);
    command = ftcs_addend_update(&any, &sample);
    __CPROVER_assert(command.addend >= slowest && command.addend <= fastest, "addend within F");
    __CPROVER_assert(command.next_addend >= slowest && command.next_addend <= fastest,
                     "next addend within F");
    __CPROVER_assert(slowest > 0, "the clock runs");
  }
}
