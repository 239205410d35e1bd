/* SPDX-License-Identifier: MIT */
/* A ptp_clock made of the kernel's cycle counter, 50 ppm fast and 1 ms ahead, follows a reference
 * by examples/embedded/zephyr: its driver's calls, its timer, its rate. Prints what the clock is
 * off at each Sync, and "locked" when it is within 300 ns. */
#include <zephyr/device.h>
#include <zephyr/drivers/ptp_clock.h>
#include <zephyr/kernel.h>
#include <zephyr/sys/printk.h>

#include "ftcs_addend.h"
#include "ftcs_ptp_servo.h"

#define EPOCH INT64_C(1700000000000000000)
#define SYNCS 40

static struct {
  uint32_t cycles;
  double rate; /* of the register */
  int64_t reference_ns;
  int64_t clock_ns;
  double reference_part; /* below a nanosecond */
  double clock_part;
} world = {.rate = 1.0, .reference_ns = EPOCH, .clock_ns = EPOCH + 1000000};

static void add(int64_t* ns, double* part, double more) {
  const int64_t whole = (int64_t)(*part + more);
  *part += more - (double)whole;
  *ns += whole;
}

static void go_on(void) {
  const uint32_t now = k_cycle_get_32();
  const double ns = (double)(now - world.cycles) * 1e9 / sys_clock_hw_cycles_per_sec();
  world.cycles = now;
  add(&world.reference_ns, &world.reference_part, ns / 1.00005);
  add(&world.clock_ns, &world.clock_part, ns * world.rate);
}

static int clock_set(const struct device* dev, struct net_ptp_time* time) {
  const unsigned int key = irq_lock();
  ARG_UNUSED(dev);
  go_on();
  world.clock_ns = (int64_t)time->second * 1000000000 + time->nanosecond;
  irq_unlock(key);
  return 0;
}

static int clock_get(const struct device* dev, struct net_ptp_time* time) {
  const unsigned int key = irq_lock();
  ARG_UNUSED(dev);
  go_on();
  time->second = (uint64_t)(world.clock_ns / 1000000000);
  time->nanosecond = (uint32_t)(world.clock_ns % 1000000000);
  irq_unlock(key);
  return 0;
}

static int clock_adjust(const struct device* dev, int increment) {
  ARG_UNUSED(dev);
  ARG_UNUSED(increment);
  return -1;
}

static int clock_rate_adjust(const struct device* dev, double ratio) {
  const unsigned int key = irq_lock();
  ARG_UNUSED(dev);
  go_on();
  world.rate = ratio;
  irq_unlock(key);
  return 0;
}

static const struct ptp_clock_driver_api api = {
    .set = clock_set, .get = clock_get, .adjust = clock_adjust, .rate_adjust = clock_rate_adjust};

DEVICE_DEFINE(ptp_model, "ptp_model", NULL, NULL, NULL, NULL, POST_KERNEL,
              CONFIG_KERNEL_INIT_PRIORITY_DEVICE, &api);

int main(void) {
  int sync;
  if (ftcs_ptp_servo_start(DEVICE_GET(ptp_model)) != 0) {
    printk("refused\n");
    return 0;
  }
  for (sync = 1; sync <= SYNCS; ++sync) {
    unsigned int key;
    int64_t origin_ns;
    int64_t receive_ns;
    int state;
    k_msleep(125);
    key = irq_lock();
    go_on();
    origin_ns = world.reference_ns;
    receive_ns = world.clock_ns;
    irq_unlock(key);
    state = ftcs_ptp_servo_sync(origin_ns, receive_ns, 0);
    printk("Sync %d offset %d ns %s\n", sync, (int)(receive_ns - origin_ns),
           state < 0 ? "error" : ftcs_addend_state_name(state));
    if (state == FTCS_ADDEND_LOCKED && receive_ns - origin_ns < 300 &&
        receive_ns - origin_ns > -300) {
      printk("locked at Sync %d\n", sync);
      return 0;
    }
  }
  printk("not locked\n");
  return 0;
}
