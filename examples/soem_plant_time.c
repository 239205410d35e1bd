/* SPDX-License-Identifier: MIT */
/* Plant time in the loop of SOEM's samples: the cycle follows the reference SubDevice (ftcs_cycle_servo), and the
 * reference slowly follows a clock of the host (ftcs_bus_clock), so that the drives of several machines act at the
 * same instants. Written for SOEM 2.0.
 *
 *   soem_plant_time INTERFACE [tai|realtime [SECONDS]]        cycle 1 ms, frames half a cycle before SYNC0
 *
 * Before SYNC0 starts all clocks are put onto plant time by one jump; afterwards the reference's 0x0920 is written
 * once a cycle and changes by some nanoseconds. OP is asked for when both are locked. Exit codes: 0 both locked and
 * all in OP at the end, 1 not, 2 wrong usage. */
#define _GNU_SOURCE

#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "examples/monotonic.h"
#include "examples/plant_clock.h"
#include "ftcs/discipline/ftcs_bus_clock.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"
#include "soem/soem.h"

static const int64_t kCycle = 1000000;
static ecx_contextt context;
static uint8 process_image[4096];
static clockid_t plant;
static int64 base_offset; /* 0x0920 of the reference when the cycles begin */

static uint16 reference(void) { return context.slavelist[context.slavelist[0].DCnext].configadr; }

/* Called by SOEM on the way from PREOP to SAFEOP: SYNC0 at whole cycles of plant time. */
static int sync0_at_whole_cycles(ecx_contextt* soem, uint16 subdevice) {
  uint16 synchronous = 2, limit = 17;
  uint32 cycle = (uint32)kCycle;
  if (!soem->slavelist[subdevice].hasdc) return 1;
  ecx_SDOwrite(soem, subdevice, 0x1C32, 1, FALSE, sizeof synchronous, &synchronous, EC_TIMEOUTRXM);
  ecx_SDOwrite(soem, subdevice, 0x1C32, 2, FALSE, sizeof cycle, &cycle, EC_TIMEOUTRXM);
  ecx_SDOwrite(soem, subdevice, 0x10F1, 2, FALSE, sizeof limit, &limit, EC_TIMEOUTRXM);
  ecx_dcsync0(soem, subdevice, TRUE, cycle, 0);
  return 1;
}

/* One and the same jump of all clocks; nobody is told to follow anybody in between. */
static void put_onto_plant_time(void) {
  int64 shown = 0, offset = 0, jump;
  int i;
  ecx_FPRD(&context.port, reference(), ECT_REG_DCSYSTIME, sizeof shown, &shown, EC_TIMEOUTRET);
  jump = plant_ns(plant) - etohll(shown);
  for (i = 1; i <= context.slavecount; ++i) {
    const uint16 station = context.slavelist[i].configadr;
    if (!context.slavelist[i].hasdc) continue;
    ecx_FPRD(&context.port, station, ECT_REG_DCSYSOFFSET, sizeof offset, &offset, EC_TIMEOUTRET);
    offset = htoell(etohll(offset) + jump);
    ecx_FPWR(&context.port, station, ECT_REG_DCSYSOFFSET, sizeof offset, &offset, EC_TIMEOUTRET);
  }
  ecx_FPRD(&context.port, reference(), ECT_REG_DCSYSOFFSET, sizeof offset, &offset, EC_TIMEOUTRET);
  base_offset = etohll(offset);
}

static int bring_up(const char* interface) {
  int i;
  int64 time = 0;
  if (!ecx_init(&context, interface) || ecx_config_init(&context) <= 0) {
    fprintf(stderr, "soem_plant_time: no SubDevices on '%s'\n", interface);
    return 0;
  }
  if (!ecx_configdc(&context)) {
    fprintf(stderr, "soem_plant_time: no SubDevice has a distributed clock\n");
    return 0;
  }
  for (i = 0; i < 5000; ++i) {
    ecx_FRMW(&context.port, reference(), ECT_REG_DCSYSTIME, sizeof time, &time, EC_TIMEOUTRET);
  }
  put_onto_plant_time();
  for (i = 1; i <= context.slavecount; ++i) {
    context.slavelist[i].PO2SOconfig = sync0_at_whole_cycles;
  }
  ecx_config_map_group(&context, process_image, 0);
  ecx_statecheck(&context, 0, EC_STATE_SAFE_OP, EC_TIMEOUTSTATE);
  return 1;
}

static uint16 all_states(void) {
  uint16 status = 0;
  ecx_BRD(&context.port, 0, ECT_REG_ALSTAT, sizeof status, &status, EC_TIMEOUTRET);
  return etohs(status);
}

/* Who left OP, perhaps after a stall of the host, has its error acknowledged and is asked again the next time. */
static void bring_back(uint16 states) {
  if (states == EC_STATE_OPERATIONAL) return;
  context.slavelist[0].state =
      (states & EC_STATE_ERROR) ? EC_STATE_SAFE_OP + EC_STATE_ACK : EC_STATE_OPERATIONAL;
  ecx_writestate(&context, 0);
}

/* Writes 0x0920 of the reference; what is in force from now on. */
static int64_t move_bus(int64_t wanted, int64_t in_force) {
  int64 offset = htoell(base_offset + wanted);
  const int counter =
      ecx_FPWR(&context.port, reference(), ECT_REG_DCSYSOFFSET, sizeof offset, &offset, EC_TIMEOUTRET);
  return counter == 1 ? wanted : in_force;
}

static int configure(ftcs_cycle_servo* servo, ftcs_bus_clock* bus) {
  ftcs_cycle_config config = ftcs_cycle_default_config();
  const ftcs_bus_config bus_config = ftcs_bus_default_config(kCycle);
  config.law = FTCS_CYCLE_ADAPTIVE;
  config.cycle_ns = kCycle;
  config.shift_ns = kCycle / 2;
  return ftcs_cycle_init(servo, sizeof *servo, &config) == FTCS_CYCLE_OK &&
         ftcs_bus_init(bus, sizeof *bus, &bus_config) == FTCS_BUS_OK;
}

static int report(const ftcs_bus_decision* moved, const ftcs_cycle_decision* decision) {
  const int in_op = all_states() == EC_STATE_OPERATIONAL;
  printf("dc to plant %+.3f us (sigma %.3f us), bus bent by %+.3f ppm, %s\n",
         (double)moved->dc_to_plant_ns * 1e-3, moved->sigma_ns * 1e-3, moved->rate_ppb * 1e-3,
         in_op ? "all in OP" : "not all in OP");
  return in_op && moved->state == FTCS_BUS_LOCKED && decision->state == FTCS_CYCLE_LOCKED;
}

static int run(double seconds) {
  static ftcs_cycle_servo servo;
  static ftcs_bus_clock bus;
  ftcs_cycle_sample frame;
  ftcs_cycle_decision decision;
  ftcs_bus_sample seen;
  ftcs_bus_decision moved;
  const long cycles = (long)(seconds * 1e9 / (double)kCycle);
  int64_t in_force = 0, usual = 100000;
  long cycle;
  int asked = 0;

  if (!configure(&servo, &bus)) return 0;
  memset(&frame, 0, sizeof frame);
  memset(&seen, 0, sizeof seen);
  memset(&moved, 0, sizeof moved);
  decision = ftcs_cycle_start(&servo, now_ns());
  for (cycle = 1; cycle <= cycles; ++cycle) {
    const int64_t scheduled = decision.wake_ns;
    int64_t sent, took;
    int counter = 0;
    sleep_until(scheduled);

    /* The frame of the cycle before, and what its plant time and offset were. */
    if (cycle > 1) counter = ecx_receive_processdata(&context, EC_TIMEOUTRET);
    if (counter <= 0) frame.has_reference = 0;
    frame.reference_ns = context.DCtime;
    decision = ftcs_cycle_update(&servo, &frame, now_ns());
    seen.usable = frame.has_reference && decision.verdict == FTCS_CYCLE_USED;
    seen.dc_ns = context.DCtime;
    moved = ftcs_bus_update(&bus, &seen);

    sent = now_ns();
    seen.plant_ns = plant_ns(plant);
    ecx_send_processdata(&context);
    took = now_ns() - sent;
    seen.offset_ns = in_force;
    frame.sent_ns = sent;
    frame.scheduled_ns = scheduled;
    frame.has_scheduled = 1;
    frame.has_reference = took < 2 * usual; /* else interrupted: nobody knows when it left */
    usual += (took - usual) / 64;
    in_force = move_bus(moved.offset_ns, in_force);

    if (!asked && decision.state == FTCS_CYCLE_LOCKED && moved.state == FTCS_BUS_LOCKED) {
      asked = 1;
      printf("both locked in cycle %ld\n", cycle);
      context.slavelist[0].state = EC_STATE_OPERATIONAL;
      ecx_writestate(&context, 0);
    }
    if (asked && cycle % 100 == 0) bring_back(all_states());
  }
  return report(&moved, &decision);
}

int main(int argc, char** argv) {
  const struct sched_param priority = {.sched_priority = 40}; /* as ec_sample's thread */
  int done = 0;
  plant = plant_clock(argc > 2 ? argv[2] : "tai");
  if (argc < 2 || plant == (clockid_t)-1) {
    fprintf(stderr, "usage: soem_plant_time INTERFACE [tai|realtime [SECONDS]]\n");
    return 2;
  }
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0 || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    fprintf(stderr, "soem_plant_time: SCHED_FIFO or mlockall refused; cycles will come late\n");
  }
  if (bring_up(argv[1])) {
    done = run(argc > 3 ? atof(argv[3]) : 20.0);
    context.slavelist[0].state = EC_STATE_INIT;
    ecx_writestate(&context, 0);
  }
  ecx_close(&context);
  return done ? 0 : 1;
}
