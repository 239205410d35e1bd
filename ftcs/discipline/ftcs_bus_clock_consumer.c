/* SPDX-License-Identifier: MIT */
/* A program in C99 that lets a distributed clock 80 ppm off and 20 us ahead follow plant time, and
 * leaves with 1 if it is not within 60 ns of it after 20 s, or if a wrong configuration passes. */
#include "ftcs/discipline/ftcs_bus_clock.h"

#include <stdio.h>

int main(void) {
  static ftcs_bus_clock clock;
  const int64_t cycle = 1000000;
  ftcs_bus_config config = ftcs_bus_default_config(cycle);
  ftcs_bus_decision decision = {0, 0, 0.0, 0.0, 0, 0};
  int64_t in_force = 0;
  int64_t true_ns = 0;
  int i;
  config.cycle_ns = 0;
  if (ftcs_bus_init(&clock, sizeof clock, &config) != FTCS_BUS_BAD_TIME) return 1;
  config.cycle_ns = cycle;
  config.limit_ppm = -1.0;
  if (ftcs_bus_init(&clock, sizeof clock, &config) != FTCS_BUS_BAD_LIMIT) return 1;
  config = ftcs_bus_default_config(cycle);
  if (ftcs_bus_init(&clock, sizeof clock - 1, &config) != FTCS_BUS_BAD_STORAGE) return 1;
  if (ftcs_bus_init(&clock, sizeof clock, &config) != FTCS_BUS_OK) return 1;
  for (i = 0; i < 20000; ++i) {
    ftcs_bus_sample sample;
    true_ns += cycle;
    sample.usable = i % 50 != 0;
    sample.offset_ns = in_force;
    sample.dc_ns = 20000 + true_ns + true_ns / 1000000 * 80 + in_force;
    sample.plant_ns = true_ns + (i * 7919) % 101 - 50;
    in_force = decision.offset_ns;
    decision = ftcs_bus_update(&clock, &sample);
  }
  {
    /* At the SYNC0 half a cycle behind the last frame. */
    const int64_t error = 20000 + true_ns / 1000000 * 80 + 40 + in_force;
    printf("state %d, %.3f ppm, told %d ns, true %d ns\n", (int)decision.state,
           decision.rate_ppb * 1e-3, (int)decision.dc_to_plant_ns, (int)error);
    return decision.state == FTCS_BUS_LOCKED && error > -60 && error < 60 ? 0 : 1;
  }
}
