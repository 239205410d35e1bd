/* SPDX-License-Identifier: MIT */
#include "ftcs_addend_private.h"

/* A servo whose configuration names no filter does not need this file. */

enum { FTCS_POSITIVE = 1, FTCS_NEGATIVE = 2, FTCS_SIGN = 3, FTCS_DOUBTED = 4 };

ftcs_addend_config ftcs_addend_quiet_config(uint32_t nominal_addend) {
  ftcs_addend_config c = ftcs_addend_default_config(nominal_addend);
  c.filter = ftcs_addend_quiet;
  c.quiet_memory = 64;
  c.gain_q16 = 65536;
  return c;
}

/* Too long a memory follows the oscillator late, and its innovations are correlated: their signs
 * tell it whatever the noise. Half of it is dropped then, and one sample added while they are
 * white. (Measured: docs/embedded.md, quiet mode.) */
static void adapt_memory(ftcs_addend_servo* s, int64_t innovation) {
  const uint16_t sign = innovation < 0 ? FTCS_NEGATIVE : FTCS_POSITIVE;
  const int32_t same = (s->last & FTCS_SIGN) == sign ? 256 : -256;
  if ((s->last & FTCS_SIGN) != 0U) {
    s->whiteness = (int16_t)(s->whiteness + (same - s->whiteness) / 24);
  }
  s->last = sign;
  if (s->whiteness > 72) {
    s->memory = (uint16_t)(s->memory - s->memory / 2U);
    s->whiteness = 16;
  } else if (s->whiteness < 0 && s->memory < s->config->quiet_memory) {
    ++s->memory;
  } else {
    /* as it is */
  }
}

/* Expanding-memory filter of degree one with n samples: of an innovation e the reference gets 2 (2
 * n - 1) / (n (n + 1)) e, the rate 6 / (n (n + 1)) e per interval. With n = 2 that is k(n) of the
 * last two samples. */
int32_t ftcs_addend_quiet(ftcs_addend_servo* s, int64_t shown, int64_t* ahead) {
  /* What the wanted rate gains on the written one. */
  const int64_t drift =
      ftcs_addend_times(ftcs_addend_divide(s->fraction, (int64_t)s->addend << 16), shown);
  const int64_t innovation = *ahead - drift - s->residue;
  const int32_t unlike =
      s->memory >= 8U && ftcs_addend_size(innovation) > 8U * s->deviation + 16U ? 1 : 0;
  if (unlike != 0 && (s->last & FTCS_DOUBTED) == 0U) {
    s->last |= FTCS_DOUBTED;
    return 0;
  }
  if (unlike != 0 || s->memory < 2U) {
    s->memory = 2;
    s->whiteness = 0;
    s->last = 0;
    s->residue = 0;
    adapt_memory(s, 0);
  } else {
    const int64_t n = s->memory;
    const int64_t pairs = n * (n + 1);
    s->deviation = ftcs_addend_average(s->deviation, ftcs_addend_size(innovation));
    s->residue = ftcs_addend_times(ftcs_addend_divide(4 * n - 2, pairs), innovation) - innovation;
    *ahead = drift + ftcs_addend_times(ftcs_addend_divide(6, pairs), innovation);
    adapt_memory(s, innovation);
  }
  return 1;
}
