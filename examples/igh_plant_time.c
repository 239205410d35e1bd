/* SPDX-License-Identifier: MIT */
/* Plant time in the loop of an application of the IgH EtherCAT Master (ecrt.h): the cycle follows the reference
 * SubDevice (ftcs_cycle_servo), and the reference slowly follows a clock of the host (ftcs_bus_clock).
 *
 *   igh_plant_time DRIVES VENDOR PRODUCT [tai|realtime [SECONDS [lead]]]
 *
 * The application time is plant time, on the grid of cycles: before SYNC0 starts IgH puts all clocks there. Afterwards
 * the reference's 0x0920 is written by a register request whenever the last one is done; it changes by some
 * nanoseconds, and an increment has no lateness. With lead the reference is told plant time itself once a cycle
 * (ecrt_master_sync_reference_clock_to(), IgH's own way: as late as the frame is), to compare. */
#define _GNU_SOURCE

#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "ecrt.h"
#include "examples/monotonic.h"
#include "examples/plant_clock.h"
#include "ftcs/discipline/ftcs_bus_clock.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"

static const int64_t kCycle = 1000000;
static const uint16_t kAssignActivate = 0x0300; /* SYNC0, as most drives have it */
static const uint16_t kSystemTimeOffset = 0x0920;

/* 0x0920 of the reference, by requests that take some cycles. */
static ec_reg_request_t* request;
static int64_t base_offset;   /* at the start; read first */
static int base_known;
static int64_t asked, in_force; /* added to it by the request under way, by the last one that is done */

static int configure(ec_master_t* master, ec_domain_t* domain, int drives, uint32_t vendor,
                     uint32_t product) {
  int n;
  for (n = 0; n < drives; ++n) {
    ec_slave_config_t* drive = ecrt_master_slave_config(master, 0, (uint16_t)n, vendor, product);
    if (drive == NULL) return 0;
    if (ecrt_slave_config_reg_pdo_entry(drive, 0x6040, 0, domain, NULL) < 0) return 0;
    if (ecrt_slave_config_reg_pdo_entry(drive, 0x6041, 0, domain, NULL) < 0) return 0;
    ecrt_slave_config_dc(drive, kAssignActivate, (uint32_t)kCycle, (int32_t)(kCycle / 2), 0, 0);
    if (n > 0) continue;
    ecrt_master_select_reference_clock(master, drive);
    request = ecrt_slave_config_create_reg_request(drive, sizeof(int64_t));
    if (request == NULL) return 0;
  }
  return 1;
}

/* Returns whether it is certain what was in force when the last frame passed. */
static int move_bus(int64_t wanted) {
  const ec_request_state_t state = ecrt_reg_request_state(request);
  if (state == EC_REQUEST_BUSY) return asked == in_force;
  if (state == EC_REQUEST_SUCCESS && !base_known) {
    base_offset = EC_READ_S64(ecrt_reg_request_data(request));
    base_known = 1;
  } else if (state == EC_REQUEST_SUCCESS) {
    in_force = asked;
  }
  if (!base_known) {
    ecrt_reg_request_read(request, kSystemTimeOffset, sizeof(int64_t));
    return 0;
  }
  asked = wanted;
  EC_WRITE_S64(ecrt_reg_request_data(request), base_offset + asked);
  ecrt_reg_request_write(request, kSystemTimeOffset, sizeof(int64_t));
  return 1;
}

static void tell_reference(ec_master_t* master, int64_t time) {
#ifdef EC_HAVE_SYNC_TO
  ecrt_master_sync_reference_clock_to(master, (uint64_t)time);
#else
  ecrt_master_application_time(master, (uint64_t)time);
  ecrt_master_sync_reference_clock(master);
#endif
}

static void run(ec_master_t* master, ec_domain_t* domain, clockid_t plant, double seconds, int lead) {
  static ftcs_cycle_servo servo;
  static ftcs_bus_clock bus;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_bus_config bus_config = ftcs_bus_default_config(kCycle);
  ftcs_cycle_decision decision;
  ftcs_cycle_sample frame;
  ftcs_bus_sample seen;
  ftcs_bus_decision moved;
  int64_t reference = plant_ns(plant); /* IgH has 32 bits of it: the rest is known from here */
  int certain = 1;
  long cycle;
  const long cycles = (long)(seconds * 1e9 / (double)kCycle);

  config.law = FTCS_CYCLE_ADAPTIVE;
  config.cycle_ns = kCycle;
  bus_config.steer = !lead;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return;
  if (ftcs_bus_init(&bus, sizeof bus, &bus_config) != FTCS_BUS_OK) return;
  memset(&frame, 0, sizeof frame);
  memset(&seen, 0, sizeof seen);
  memset(&moved, 0, sizeof moved);
  decision = ftcs_cycle_start(&servo, now_ns());
  for (cycle = 1; cycle <= cycles; ++cycle) {
    const int64_t scheduled = decision.wake_ns;
    uint32_t low = 0;
    sleep_until(scheduled);

    ecrt_master_receive(master);
    ecrt_domain_process(domain);
    frame.has_reference = cycle > 1 && ecrt_master_reference_clock_time(master, &low) == 0;
    if (frame.has_reference) reference = ftcs_cycle_unwrap(reference, low);
    frame.reference_ns = reference;
    decision = ftcs_cycle_update(&servo, &frame, now_ns());
    seen.usable = frame.has_reference && certain && decision.verdict == FTCS_CYCLE_USED;
    seen.dc_ns = reference;
    moved = ftcs_bus_update(&bus, &seen);

    /* Here the application computes its outputs. */

    seen.plant_ns = plant_ns(plant);
    frame.sent_ns = now_ns();
    ecrt_master_application_time(master,
                                 (uint64_t)((seen.plant_ns + kCycle / 2) / kCycle * kCycle));
    if (lead) tell_reference(master, seen.plant_ns);
    ecrt_master_sync_slave_clocks(master);
    ecrt_domain_queue(domain);
    frame.has_scheduled = 1;
    frame.scheduled_ns = scheduled;
    if (!lead) certain = move_bus(moved.offset_ns);
    seen.offset_ns = in_force;
    ecrt_master_send(master);

    if (cycle % 1000 == 0) {
      printf("cycle %s, bus state %d, dc to plant %+.3f us (sigma %.3f us), bent by %+.3f ppm\n",
             ftcs_cycle_state_name(decision.state), moved.state,
             (double)moved.dc_to_plant_ns * 1e-3, moved.sigma_ns * 1e-3, moved.rate_ppb * 1e-3);
    }
  }
}

int main(int argc, char** argv) {
  const struct sched_param priority = {.sched_priority = 80};
  const clockid_t plant = plant_clock(argc > 4 ? argv[4] : "tai");
  ec_master_t* master;
  ec_domain_t* domain;
  if (argc < 4 || plant == (clockid_t)-1) {
    fprintf(stderr, "usage: igh_plant_time DRIVES VENDOR PRODUCT [tai|realtime [SECONDS [lead]]]\n");
    return 2;
  }
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0 || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    fprintf(stderr, "igh_plant_time: SCHED_FIFO or mlockall refused; cycles will come late\n");
  }
  master = ecrt_request_master(0);
  domain = master == NULL ? NULL : ecrt_master_create_domain(master);
  if (domain != NULL) ecrt_master_application_time(master, (uint64_t)plant_ns(plant));
  if (domain == NULL ||
      !configure(master, domain, atoi(argv[1]), (uint32_t)strtoul(argv[2], NULL, 0),
                 (uint32_t)strtoul(argv[3], NULL, 0)) ||
      ecrt_master_activate(master) != 0) {
    fprintf(stderr, "igh_plant_time: master 0 is not there or refuses this configuration\n");
    return 1;
  }
  run(master, domain, plant, argc > 5 ? atof(argv[5]) : 10.0, argc > 6 && strcmp(argv[6], "lead") == 0);
  ecrt_release_master(master);
  return 0;
}
