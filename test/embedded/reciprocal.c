/* SPDX-License-Identifier: MIT */
/* Every divisor that the arithmetic can have: 2^63 / d - 1 - 2^-10 < reciprocal(d) < 2^63 / d +
 * 2^-10, and the quotients at the edges of the mantissa. */
#include <stdio.h>

#include "../../embedded/ftcs_addend_arithmetic.c"

static int check(uint32_t d) {
  const uint64_t product = (uint64_t)reciprocal(d) * d;
  const uint64_t one = UINT64_C(1) << 63;
  return product < one + (d >> 10) && product + d + (d >> 10) > one;
}

static int check_quotient(uint64_t n, uint32_t d) {
  const ftcs_addend_ratio r = ftcs_addend_divide((int64_t)n, d);
  const uint64_t product = (uint64_t)(r >> 32) * d;
  const uint64_t exact = n << 30; /* 1 <= n / d < 2: one place after the sign */
  const uint64_t error = product > exact ? product - exact : exact - product;
  return (r & 63) == 1 && r > 0 && error < (uint64_t)d + (d >> 1);
}

int main(void) {
  uint32_t d = 0x80000000U;
  uint32_t i;
  do {
    if (check(d) == 0) {
      printf("reciprocal(0x%x) is 0x%x\n", d, reciprocal(d));
      return 1;
    }
    ++d;
  } while (d != 0U);
  for (i = 0; i < 1U << 20; ++i) {
    const uint32_t near = 0x80000000U + (i & 1023U);
    const uint32_t n = UINT32_MAX - (i >> 10);
    if (check_quotient(n, near) == 0) {
      printf("0x%x / 0x%x is %lld\n", n, near, (long long)ftcs_addend_divide(n, near));
      return 1;
    }
  }
  return 0;
}
