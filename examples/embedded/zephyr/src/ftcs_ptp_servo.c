/* SPDX-License-Identifier: MIT */
#include "ftcs_ptp_servo.h"

#include <zephyr/drivers/ptp_clock.h>
#include <zephyr/kernel.h>

#include "actuators/adjfine.h"
#include "ftcs_addend.h"

/* ptp_clock takes a ratio to nominal; any number will do for the nominal addend. */
#define NOMINAL (1U << 31)
#define NS_PER_SECOND 1000000000

static const ftcs_addend_config config = {
    .nominal_addend = NOMINAL,
    .limit_ppm = 50000,
    .plausible_ppm = 100000,
    .gain_q16 = 65536,
    .band_enter_ns = FTCS_ADDEND_UNBOUNDED,
    .band_leave_ns = FTCS_ADDEND_UNBOUNDED,
    .lock_enter_ns = 1000,
    .lock_leave_ns = 5000,
    .dwell = 1,
    .filter = ftcs_addend_quiet,
    .quiet_memory = 64,
};
static ftcs_addend_servo servo;
static const struct device* device;
static uint32_t next_addend;

static void correction_over(struct k_work* work);
static K_WORK_DELAYABLE_DEFINE(end_of_correction, correction_over);
static K_MUTEX_DEFINE(lock); /* the servo belongs to one thread at a time */

static int64_t now_ns(void) {
  struct net_ptp_time time;
  if (ptp_clock_get(device, &time) != 0) return 0;
  return (int64_t)time.second * NS_PER_SECOND + time.nanosecond;
}

static int set_addend(uint32_t addend) {
  return ptp_clock_rate_adjust(device, ftcs_rate_ratio(addend, NOMINAL));
}

/* The kernel's time, to a microsecond, in which the clock at `addend` goes on by `clock_ns`. */
static int64_t kernel_ns(int64_t clock_ns, uint32_t addend) {
  return clock_ns / 1024 * NOMINAL / addend * 1024;
}

/* A kernel timer is late by up to a tick, and says how much. */
static void correction_over(struct k_work* work) {
  (void)work;
  (void)k_mutex_lock(&lock, K_FOREVER);
  if (set_addend(next_addend) == 0) ftcs_addend_wrote_next(&servo, now_ns());
  (void)k_mutex_unlock(&lock);
}

int ftcs_ptp_servo_start(const struct device* clock) {
  device = clock;
  return ftcs_addend_init(&servo, &config, NOMINAL) == FTCS_ADDEND_OK ? set_addend(NOMINAL) : -1;
}

/* A first offset beyond a second is set; the servo never steps. */
static int set_time(int64_t to_ns) {
  struct net_ptp_time time = {0};
  time.second = (uint64_t)(to_ns / NS_PER_SECOND);
  time.nanosecond = (uint32_t)(to_ns % NS_PER_SECOND);
  ftcs_addend_reset(&servo);
  return ptp_clock_set(device, &time);
}

int ftcs_ptp_servo_sync(int64_t origin_ns, int64_t receive_ns, int64_t path_delay_scaled) {
  const int64_t offset_ns = receive_ns - origin_ns - path_delay_scaled / 65536;
  ftcs_addend_sample sample = {origin_ns, receive_ns, 0, path_delay_scaled, 0, 0};
  ftcs_addend_command command;
  int error = 0;
  (void)k_mutex_lock(&lock, K_FOREVER);
  sample.now_ns = now_ns();
  if (offset_ns > NS_PER_SECOND || offset_ns < -NS_PER_SECOND) {
    error = set_time(sample.now_ns - offset_ns);
    (void)k_mutex_unlock(&lock);
    return error < 0 ? error : (int)FTCS_ADDEND_WAITING;
  }
  command = ftcs_addend_update(&servo, &sample);
  if (command.act != 0) {
    (void)k_work_cancel_delayable(&end_of_correction);
    error = set_addend(command.addend);
    ftcs_addend_wrote(&servo, now_ns(), command.addend, command.next_addend);
    next_addend = command.next_addend;
    (void)k_work_schedule(&end_of_correction,
                          K_NSEC(kernel_ns(command.until_ns - now_ns(), command.addend)));
  }
  (void)k_mutex_unlock(&lock);
  return error < 0 ? error : command.state;
}
