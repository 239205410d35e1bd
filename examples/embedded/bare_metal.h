/* SPDX-License-Identifier: MIT */
#ifndef FTCS_BARE_METAL_H
#define FTCS_BARE_METAL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Yours: a counter of 32 bits at 25 MHz that wraps. */
uint32_t timer_ticks(void);

/* Zero: the configuration fits. */
int32_t bare_clock_start(int64_t now_ns);
/* The time; take it as the receive stamp as close to the wire as you can. */
int64_t bare_clock_now(void);
/* For each Sync, from whatever carries it (Ethernet, CAN, a serial line): t1, the receive stamp,
 * the mean path delay in 2^-16 ns. Returns an enum ftcs_addend_state. */
int32_t bare_clock_sync(int64_t origin_ns, int64_t receive_ns, int64_t path_delay_scaled);

#ifdef __cplusplus
}
#endif

#endif
