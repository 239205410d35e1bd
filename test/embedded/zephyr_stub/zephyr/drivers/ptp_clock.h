/* SPDX-License-Identifier: MIT */
#pragma once
#include <stdint.h>
#include <zephyr/device.h>
struct net_ptp_time {
  uint64_t second;
  uint32_t nanosecond;
};
int ptp_clock_set(const struct device* dev, struct net_ptp_time* time);
int ptp_clock_get(const struct device* dev, struct net_ptp_time* time);
int ptp_clock_rate_adjust(const struct device* dev, double rate);
