/* SPDX-License-Identifier: MIT */
#ifndef FTCS_PTP_SERVO_H
#define FTCS_PTP_SERVO_H

#include <stdint.h>
#include <zephyr/device.h>

/* One PTP clock. The correction ends by a work item when its time is over: a lost Sync does no
 * harm. */
int ftcs_ptp_servo_start(const struct device* clock);
/* t1 plus correction, t2 of that clock, mean path delay in 2^-16 ns. Returns an enum
 * ftcs_addend_state, or below zero what the driver returned. */
int ftcs_ptp_servo_sync(int64_t origin_ns, int64_t receive_ns, int64_t path_delay_scaled);

#endif
