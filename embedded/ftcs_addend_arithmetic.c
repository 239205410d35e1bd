/* SPDX-License-Identifier: MIT */
#include "ftcs_addend_private.h"

#if defined(__ARM_ARCH_6M__) || defined(FTCS_ADDEND_NARROW)
uint64_t ftcs_addend_product(uint32_t a, uint32_t b) {
  const uint32_t low = (a & 0xFFFFU) * (b & 0xFFFFU);
  const uint32_t cross = (a >> 16) * (b & 0xFFFFU) + (low >> 16);
  const uint32_t other = (a & 0xFFFFU) * (b >> 16) + (cross & 0xFFFFU);
  const uint32_t high = (a >> 16) * (b >> 16) + (cross >> 16) + (other >> 16);
  return ((uint64_t)high << 32) | (other << 16) | (low & 0xFFFFU);
}

int64_t ftcs_addend_signed_product(int32_t a, int32_t b) {
  const uint32_t below = ((uint32_t)a & (uint32_t)(b >> 31)) + ((uint32_t)b & (uint32_t)(a >> 31));
  return (int64_t)(ftcs_addend_product((uint32_t)a, (uint32_t)b) - ((uint64_t)below << 32));
}

int64_t ftcs_addend_mixed_product(uint32_t a, int32_t b) {
  const uint32_t below = a & (uint32_t)(b >> 31);
  return (int64_t)(ftcs_addend_product(a, (uint32_t)b) - ((uint64_t)below << 32));
}
#endif

/* Leading zeros of a number that is not zero. */
static uint32_t leading_zeros(uint32_t x) {
#if defined(__GNUC__) && !defined(FTCS_ADDEND_PORTABLE)
  return (uint32_t)__builtin_clz(x);
#else
  uint32_t zeros = 0;
  while (x < 0x80000000U) {
    x <<= 1;
    ++zeros;
  }
  return zeros;
#endif
}

/* The 32 highest bits of a number in the upper half; in the lower, how far it was shifted to the
 * left for that. Zero is taken for one. */
static FTCS_INLINE uint64_t highest_bits(uint64_t x) {
  uint32_t upper = (uint32_t)(x >> 32);
  uint32_t lower = (uint32_t)x;
  uint32_t zeros;
  if (upper != 0U) {
    zeros = leading_zeros(upper);
    upper = (upper << zeros) | ((lower >> 1) >> (31U - zeros));
  } else {
    zeros = leading_zeros(lower | 1U);
    upper = lower << zeros;
    zeros += 32U;
  }
  return ((uint64_t)upper << 32) | zeros;
}

/* 2^63 / d for d >= 2^31, less than one too small: a quotient of 16 bits and the terms e and e^2 of
 * 1 / (1 - e), e what it lacks. Every d: test/embedded/reciprocal.c. */
static uint32_t reciprocal(uint32_t d) {
  const uint32_t guess = UINT32_MAX / ((d >> 15) | 1U) * 2U + 1U; /* 2^48 / d */
  const uint64_t lacks = (UINT64_C(1) << 48) - ftcs_addend_product(guess, d);
  const int32_t error = (int32_t)(uint32_t)(lacks >> 2);
  const int32_t rough = error >> 16;
  const int64_t more = ftcs_addend_signed_product((int32_t)guess, error + (rough * rough >> 14));
  return (guess << 15) + (uint32_t)((uint64_t)more >> 31);
}

ftcs_addend_ratio ftcs_addend_divide(int64_t n, int64_t d) {
  const uint64_t dividend = highest_bits(n < 0 ? 0U - (uint64_t)n : (uint64_t)n);
  const uint64_t divisor = highest_bits((uint64_t)d);
  const uint64_t product =
      ftcs_addend_product((uint32_t)(dividend >> 32), reciprocal((uint32_t)(divisor >> 32))) +
      (UINT64_C(3) << 30); /* half a unit, and half of what the reciprocal lacks at most */
  const uint32_t above = (uint32_t)(product >> 63); /* 1: the mantissas' quotient is */
  const uint32_t upper = (uint32_t)(product >> 32);
  int32_t mantissa = (int32_t)((upper >> above) + (upper & above));
  int32_t shift = (int32_t)((uint32_t)dividend - (uint32_t)divisor + 2U - above);
  if (shift < 0) shift = 0;
  if (shift > 31) {
    mantissa >>= shift - 31;
    shift = 31;
  }
  if (n < 0) mantissa = -mantissa;
  return (int64_t)((uint64_t)(uint32_t)mantissa << 32 | (uint32_t)shift);
}

ftcs_addend_ratio ftcs_addend_change(uint32_t to, uint32_t from) {
  return ftcs_addend_divide((int64_t)to - (int64_t)from, from);
}

/* x / 2^shift, shift below 32. */
static int64_t shifted(int64_t x, uint32_t shift) {
  const int32_t upper = (int32_t)(uint32_t)((uint64_t)x >> 32);
  const uint32_t low = (uint32_t)x >> shift | ((uint32_t)upper << 1) << (31U - shift);
  return (int64_t)((uint64_t)(uint32_t)(upper >> shift) << 32 | low);
}

/* The upper 64 bits of 96, times 8: three bits less than there could be where r is 1/2 or more. */
int64_t ftcs_addend_times(ftcs_addend_ratio r, int64_t x) {
  const int32_t mantissa = (int32_t)(uint32_t)((uint64_t)r >> 32);
  const uint64_t product =
      (uint64_t)ftcs_addend_signed_product((int32_t)(uint32_t)((uint64_t)x >> 32), mantissa) +
      (uint64_t)(ftcs_addend_mixed_product((uint32_t)x, mantissa) >> 32);
  return shifted((int64_t)(product << 3), (uint32_t)r);
}

#if FTCS_OPTIONS
int64_t ftcs_addend_of(ftcs_addend_ratio r, uint32_t addend) {
  const int32_t mantissa = (int32_t)(uint32_t)((uint64_t)r >> 32);
  const int64_t product = ftcs_addend_mixed_product(addend, mantissa);
  return shifted((product >> 13) & ~(int64_t)7, (uint32_t)r);
}
#endif

int64_t ftcs_addend_difference(int64_t a_ns, int64_t b_ns) {
  int64_t d = (int64_t)((uint64_t)a_ns - (uint64_t)b_ns);
  if ((uint32_t)((uint64_t)d >> 32) + 0x200U >= 0x400U) {
    d = d < 0 ? -FTCS_LONGEST_NS : FTCS_LONGEST_NS;
  }
  return d * 65536;
}
