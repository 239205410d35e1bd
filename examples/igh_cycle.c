/* SPDX-License-Identifier: MIT */
/* The cyclic loop of an application of the IgH EtherCAT Master (ecrt.h), kept in phase with the reference
 * SubDevice by the cycle servo. IgH has no such servo of its own: its example pushes the host's clock into the
 * reference. Here the reference is never written (no ecrt_master_sync_reference_clock()).
 *
 *   igh_cycle DRIVES VENDOR PRODUCT [SECONDS]     CiA 402 drives at positions 0 .. DRIVES-1, numbers as in 0xF7C5
 *
 * IgH hands out the reference time of the cycle before, 32 bits: scheduled_ns and ftcs_cycle_unwrap(). */
#define _GNU_SOURCE

#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "ecrt.h"
#include "examples/monotonic.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"

static const int64_t kCycle = 1000000;
static const uint16_t kAssignActivate = 0x0300; /* SYNC0, as most drives have it */

/* Drives with the mapping that their SII describes; SYNC0 half a cycle after the frames. */
static int configure(ec_master_t* master, ec_domain_t* domain, int drives, uint32_t vendor,
                     uint32_t product) {
  int n;
  for (n = 0; n < drives; ++n) {
    ec_slave_config_t* drive = ecrt_master_slave_config(master, 0, (uint16_t)n, vendor, product);
    if (drive == NULL) return 0;
    if (ecrt_slave_config_reg_pdo_entry(drive, 0x6040, 0, domain, NULL) < 0) return 0;
    if (ecrt_slave_config_reg_pdo_entry(drive, 0x6041, 0, domain, NULL) < 0) return 0;
    ecrt_slave_config_dc(drive, kAssignActivate, (uint32_t)kCycle, (int32_t)(kCycle / 2), 0, 0);
    if (n == 0) ecrt_master_select_reference_clock(master, drive);
  }
  return 1;
}

/* Reference time at a wake-up, on the grid of cycles; before there is one the host's. SYNC0's phase hangs
 * on it, so it must never be the time that was measured. */
static uint64_t application_time(const ftcs_cycle_sample* frame, int64_t wake_ns, int known) {
  const int64_t time = known ? frame->reference_ns + (wake_ns - frame->sent_ns) : wake_ns;
  return (uint64_t)((time + kCycle / 2) / kCycle * kCycle);
}

static void run(ec_master_t* master, ec_domain_t* domain, double seconds) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_cycle_decision decision;
  ftcs_cycle_sample frame;
  ftcs_cycle_sample latched; /* the last frame that came back */
  int64_t reference = 0;
  int known = 0;
  long cycle, locked_at = -1;
  const long cycles = (long)(seconds * 1e9 / (double)kCycle);

  config.law = FTCS_CYCLE_ADAPTIVE;
  config.cycle_ns = kCycle;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return;
  memset(&frame, 0, sizeof frame);
  memset(&latched, 0, sizeof latched);
  decision = ftcs_cycle_start(&servo, now_ns());
  for (cycle = 1; cycle <= cycles; ++cycle) {
    const int64_t scheduled = decision.wake_ns;
    uint32_t low = 0;
    sleep_until(scheduled);

    ecrt_master_receive(master);
    ecrt_domain_process(domain);
    frame.has_reference = cycle > 1 && ecrt_master_reference_clock_time(master, &low) == 0;
    if (frame.has_reference) {
      reference = ftcs_cycle_unwrap(reference, low);
      frame.reference_ns = reference;
      latched = frame;
      known = 1;
    }
    decision = ftcs_cycle_update(&servo, &frame, now_ns());

    /* Here the application computes its outputs. */

    ecrt_master_application_time(master, application_time(&latched, scheduled, known));
    ecrt_master_sync_slave_clocks(master);
    ecrt_domain_queue(domain);
    frame.has_scheduled = 1;
    frame.scheduled_ns = scheduled;
    frame.sent_ns = now_ns();
    ecrt_master_send(master);

    if (decision.state == FTCS_CYCLE_LOCKED && locked_at < 0) locked_at = cycle;
    if (cycle % 1000 == 0) {
      printf("%s (since cycle %ld), phase %+.3f us, rate %+.3f ppm, lateness %.1f us\n",
             ftcs_cycle_state_name(decision.state), locked_at,
             (double)decision.phase_error_ns * 1e-3, decision.rate_ppb * 1e-3,
             (double)decision.lateness_ns * 1e-3);
    }
  }
}

int main(int argc, char** argv) {
  const struct sched_param priority = {.sched_priority = 80};
  ec_master_t* master;
  ec_domain_t* domain;
  if (argc < 4) {
    fprintf(stderr, "usage: igh_cycle DRIVES VENDOR PRODUCT [SECONDS]\n");
    return 2;
  }
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0 || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    fprintf(stderr, "igh_cycle: SCHED_FIFO or mlockall refused; cycles will come late\n");
  }
  master = ecrt_request_master(0);
  domain = master == NULL ? NULL : ecrt_master_create_domain(master);
  if (domain == NULL ||
      !configure(master, domain, atoi(argv[1]), (uint32_t)strtoul(argv[2], NULL, 0),
                 (uint32_t)strtoul(argv[3], NULL, 0)) ||
      ecrt_master_activate(master) != 0) {
    fprintf(stderr, "igh_cycle: master 0 is not there or refuses this configuration\n");
    return 1;
  }
  run(master, domain, argc > 4 ? atof(argv[4]) : 10.0);
  ecrt_release_master(master);
  return 0;
}
