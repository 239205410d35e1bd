/* SPDX-License-Identifier: MIT */
/* The cyclic loop of SOEM's samples (receive, process, send), kept in phase with the reference SubDevice by
 * the cycle servo, where ec_sample has a PI. Written for SOEM 2.0.
 *
 *   soem_cycle INTERFACE [LAW [SECONDS [CYCLE_US [SHIFT_US [slew]]]]]      LAW: ftcs, pics, adaptive, none
 *
 * With slew the first phase is removed by the servo, as a PI does; without it the second cycle is put
 * where it belongs.
 * Each cycle takes back the frame of the cycle before: scheduled_ns says so. SYNC0 comes at whole cycles,
 * frames leave SHIFT_US after them (half a cycle). SubDevices are asked for OP when the servo is locked.
 * Exit codes: 0 locked and in OP to the end, 1 not, 2 wrong usage. */
#define _GNU_SOURCE

#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "examples/monotonic.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"
#include "soem/soem.h"

enum { MOST_CYCLES = 1000000 };

static const char* const kLaws[] = {"none", "ftcs", "pics", "adaptive"};

static ecx_contextt context;
static uint8 process_image[4096];
static int64_t cycle_ns = 1000000;
static int32_t phases[MOST_CYCLES]; /* of the virtual cycle, since the lock */

static void become_realtime(void) {
  const struct sched_param priority = {.sched_priority = 40}; /* as ec_sample's thread */
  const int scheduled = sched_setscheduler(0, SCHED_FIFO, &priority);
  const int locked = mlockall(MCL_CURRENT | MCL_FUTURE);
  printf("SCHED_FIFO %s, mlockall %s\n", scheduled == 0 ? "obtained" : "refused",
         locked == 0 ? "obtained" : "refused");
}

/* Called by SOEM on the way from PREOP to SAFEOP: synchronous to SYNC0, which comes at whole cycles of
 * reference time. SubDevices that know it by themselves refuse the object; that does no harm. */
static int sync0_at_whole_cycles(ecx_contextt* soem, uint16 subdevice) {
  uint16 synchronous = 2;
  uint32 cycle = (uint32)cycle_ns;
  uint16 limit = 17; /* a missed SYNC0 counts three, a good one takes one off: six in a row are an error */
  if (!soem->slavelist[subdevice].hasdc) return 1;
  ecx_SDOwrite(soem, subdevice, 0x1C32, 1, FALSE, sizeof synchronous, &synchronous, EC_TIMEOUTRXM);
  ecx_SDOwrite(soem, subdevice, 0x1C32, 2, FALSE, sizeof cycle, &cycle, EC_TIMEOUTRXM);
  ecx_SDOwrite(soem, subdevice, 0x10F1, 2, FALSE, sizeof limit, &limit, EC_TIMEOUTRXM);
  ecx_dcsync0(soem, subdevice, TRUE, cycle, 0);
  return 1;
}

/* Lets the clocks agree before SYNC0 is started: system time of the reference, written to all others. */
static void settle_clocks(int frames) {
  const uint16 reference = context.slavelist[context.slavelist[0].DCnext].configadr;
  int64 time = 0;
  int i;
  for (i = 0; i < frames; ++i) {
    ecx_FRMW(&context.port, reference, ECT_REG_DCSYSTIME, sizeof time, &time, EC_TIMEOUTRET);
  }
}

static int bring_up(const char* interface) {
  int i;
  if (!ecx_init(&context, interface)) {
    fprintf(stderr, "soem_cycle: no socket on '%s'\n", interface);
    return 0;
  }
  if (ecx_config_init(&context) <= 0) {
    fprintf(stderr, "soem_cycle: no SubDevices on '%s'\n", interface);
    return 0;
  }
  if (!ecx_configdc(&context)) {
    fprintf(stderr, "soem_cycle: no SubDevice has a distributed clock\n");
    return 0;
  }
  settle_clocks(5000);
  for (i = 1; i <= context.slavecount; ++i) {
    context.slavelist[i].PO2SOconfig = sync0_at_whole_cycles;
  }
  ecx_config_map_group(&context, process_image, 0);
  ecx_statecheck(&context, 0, EC_STATE_SAFE_OP, EC_TIMEOUTSTATE);
  return 1;
}

/* AL status of all SubDevices, OR-ed. (ecx_statecheck() sleeps for a millisecond: not in this loop.) */
static uint16 all_states(void) {
  uint16 status = 0;
  ecx_BRD(&context.port, 0, ECT_REG_ALSTAT, sizeof status, &status, EC_TIMEOUTRET);
  return etohs(status);
}

static int compare(const void* a, const void* b) {
  const int32_t left = *(const int32_t*)a, right = *(const int32_t*)b;
  return (left > right) - (left < right);
}

/* What the run came to, in cycles. */
static struct {
  long answered, complete, gated, judged, locked_at, op_at, recoveries;
  unsigned long long skipped;
  int in_op;
} seen = {.locked_at = -1, .op_at = -1};

/* The frame of this cycle: when it left, and whether that is to be believed. */
static void send_frame(ftcs_cycle_sample* frame, int64_t scheduled, int64_t* usual) {
  const int64_t sent = now_ns();
  int64_t took;
  ecx_send_processdata(&context);
  took = now_ns() - sent;
  frame->sent_ns = sent;
  frame->scheduled_ns = scheduled;
  frame->has_scheduled = 1;
  frame->has_reference = took < 2 * *usual; /* else interrupted: nobody knows when it left */
  *usual += (took - *usual) / 64;
}

/* Once locked: asks for OP, and again where some left it. */
static void hold_op(long cycle) {
  uint16 states;
  if (seen.locked_at < 0) {
    seen.locked_at = cycle;
    context.slavelist[0].state = EC_STATE_OPERATIONAL;
    ecx_writestate(&context, 0);
  }
  if (cycle % 100 != 0) return;
  states = all_states();
  seen.in_op = states == EC_STATE_OPERATIONAL;
  if (seen.in_op && seen.op_at < 0) seen.op_at = cycle;
  if (!seen.in_op && seen.op_at >= 0) {
    /* Some left OP: acknowledge first, ask again the next time. */
    ++seen.recoveries;
    context.slavelist[0].state =
        (states & EC_STATE_ERROR) ? EC_STATE_SAFE_OP + EC_STATE_ACK : EC_STATE_OPERATIONAL;
    ecx_writestate(&context, 0);
  }
}

static void report(const ftcs_cycle_decision* decision, int32_t law, int expected, long cycles) {
  long i;
  printf("%s: %s, locked in cycle %ld, OP in cycle %ld, %s at the end (%ld requests to come "
         "back), rate %+.3f ppm\n",
         kLaws[law], ftcs_cycle_state_name(decision->state), seen.locked_at, seen.op_at,
         seen.in_op ? "all in OP" : "not all in OP", seen.recoveries, decision->rate_ppb * 1e-3);
  printf("working counter %d in %ld of %ld frames that came back, %ld cycles; %ld cycles gated or lost, "
         "%llu passed over by stalls\n",
         expected, seen.complete, seen.answered, cycles, seen.gated, seen.skipped);
  if (seen.judged == 0) return;
  for (i = 0; i < seen.judged; ++i) phases[i] = abs(phases[i]);
  qsort(phases, (size_t)seen.judged, sizeof phases[0], compare);
  printf("|phase| of the virtual cycle since the lock: p50 %d p99 %d max %d ns\n",
         phases[seen.judged / 2], phases[seen.judged * 99 / 100], phases[seen.judged - 1]);
}

/* Runs the cycles; returns non-zero when locked and in OP at the end. */
static int run(const ftcs_cycle_config* config, double seconds) {
  static ftcs_cycle_servo servo;
  const int expected = context.grouplist[0].outputsWKC * 2 + context.grouplist[0].inputsWKC;
  ftcs_cycle_sample frame;
  ftcs_cycle_decision decision;
  long cycle, cycles = (long)(seconds * 1e9 / (double)config->cycle_ns);
  int64_t usual = 100000; /* how long a send takes, ns: a moving average */
  const int error = ftcs_cycle_init(&servo, sizeof servo, config);
  if (error != FTCS_CYCLE_OK) {
    fprintf(stderr, "soem_cycle: the servo refuses its configuration (error %d)\n", error);
    return 0;
  }
  if (cycles > MOST_CYCLES) cycles = MOST_CYCLES;
  memset(&frame, 0, sizeof frame);
  decision = ftcs_cycle_start(&servo, now_ns());
  for (cycle = 1; cycle <= cycles; ++cycle) {
    const int64_t scheduled = decision.wake_ns;
    int counter = 0;
    sleep_until(scheduled);

    /* The frame of the cycle before: in the socket's buffer by now. */
    if (cycle > 1) counter = ecx_receive_processdata(&context, EC_TIMEOUTRET);
    if (counter <= 0) frame.has_reference = 0;
    frame.reference_ns = context.DCtime;
    decision = ftcs_cycle_update(&servo, &frame, now_ns());

    /* Here the application computes its outputs. */

    send_frame(&frame, scheduled, &usual);
    seen.answered += counter > 0;
    seen.complete += counter == expected;
    seen.gated += decision.verdict != FTCS_CYCLE_USED;
    seen.skipped += decision.skipped;
    if (decision.state != FTCS_CYCLE_LOCKED) continue;
    hold_op(cycle);
    if (decision.verdict == FTCS_CYCLE_USED) phases[seen.judged++] = (int32_t)decision.phase_error_ns;
  }
  report(&decision, config->law, expected, cycles);
  return decision.state == FTCS_CYCLE_LOCKED && seen.in_op;
}

int main(int argc, char** argv) {
  ftcs_cycle_config config = ftcs_cycle_default_config();
  int done = 0;
  if (argc < 2) {
    fprintf(stderr, "usage: soem_cycle INTERFACE [LAW [SECONDS [CYCLE_US [SHIFT_US [slew]]]]]\n");
    return 2;
  }
  config.law = FTCS_CYCLE_ADAPTIVE;
  if (argc > 2) {
    for (config.law = FTCS_CYCLE_NONE; config.law <= FTCS_CYCLE_ADAPTIVE; ++config.law) {
      if (strcmp(argv[2], kLaws[config.law]) == 0) break;
    }
    if (config.law > FTCS_CYCLE_ADAPTIVE) {
      fprintf(stderr, "soem_cycle: '%s' is none of none, ftcs, pics, adaptive\n", argv[2]);
      return 2;
    }
  }
  if (argc > 4) cycle_ns = atoi(argv[4]) * 1000LL;
  config.cycle_ns = cycle_ns;
  config.shift_ns = argc > 5 ? atoi(argv[5]) * 1000LL : cycle_ns / 2; /* half-way between SYNC0s */
  if (argc > 6) config.align_at_start = strcmp(argv[6], "slew") != 0;
  become_realtime();
  if (bring_up(argv[1])) {
    done = run(&config, argc > 3 ? atof(argv[3]) : 10.0);
    context.slavelist[0].state = EC_STATE_INIT;
    ecx_writestate(&context, 0);
  }
  ecx_close(&context);
  return done ? 0 : 1;
}
