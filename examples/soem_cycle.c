/* SPDX-License-Identifier: MIT */
/* The cyclic loop of SOEM's samples (receive, process, send), kept in phase with the reference SubDevice by
 * the cycle servo, where ec_sample has a PI. Written for SOEM 2.0.
 *
 *   soem_cycle INTERFACE [LAW [SECONDS [CYCLE_US [SHIFT_US [slew]]]]]      LAW: ftcs, pics, adaptive, none
 *
 * With slew the first phase is removed by the servo, as a PI does; without it the second cycle is put
 * where it belongs.
 * Each cycle takes back the frame of the cycle before: scheduled_ns says so. SubDevices are asked for OP
 * when the servo is locked. Exit codes: 0 locked and in OP, 1 not, 2 wrong usage. */
#define _GNU_SOURCE

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#include "ftcs/discipline/ftcs_cycle_servo.h"
#include "soem/soem.h"

enum { MOST_CYCLES = 1000000 };

static const int64_t kSecond = 1000000000;
static const char* const kLaws[] = {"none", "ftcs", "pics", "adaptive"};

static ecx_contextt context;
static uint8 process_image[4096];
static int32_t phases[MOST_CYCLES]; /* of the virtual cycle, since the lock */

static int64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

static void sleep_until(int64_t instant_ns) {
  struct timespec wake;
  wake.tv_sec = instant_ns / kSecond;
  wake.tv_nsec = instant_ns % kSecond;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL) == EINTR) continue;
}

static void become_realtime(void) {
  const struct sched_param priority = {.sched_priority = 40}; /* as ec_sample's thread */
  const int scheduled = sched_setscheduler(0, SCHED_FIFO, &priority);
  const int locked = mlockall(MCL_CURRENT | MCL_FUTURE);
  printf("SCHED_FIFO %s, mlockall %s\n", scheduled == 0 ? "obtained" : "refused",
         locked == 0 ? "obtained" : "refused");
}

static int bring_up(const char* interface) {
  if (!ecx_init(&context, interface)) {
    fprintf(stderr, "soem_cycle: no socket on '%s'\n", interface);
    return 0;
  }
  if (ecx_config_init(&context) <= 0) {
    fprintf(stderr, "soem_cycle: no SubDevices on '%s'\n", interface);
    return 0;
  }
  ecx_config_map_group(&context, process_image, 0);
  if (!ecx_configdc(&context)) {
    fprintf(stderr, "soem_cycle: no SubDevice has a distributed clock\n");
    return 0;
  }
  ecx_statecheck(&context, 0, EC_STATE_SAFE_OP, EC_TIMEOUTSTATE);
  return 1;
}

static int compare(const void* a, const void* b) {
  const int32_t left = *(const int32_t*)a, right = *(const int32_t*)b;
  return (left > right) - (left < right);
}

/* Runs the cycles; returns non-zero when locked and in OP at the end. */
static int run(const ftcs_cycle_config* config, double seconds) {
  static ftcs_cycle_servo servo;
  const int expected = context.grouplist[0].outputsWKC * 2 + context.grouplist[0].inputsWKC;
  ftcs_cycle_sample frame;
  ftcs_cycle_decision decision;
  long cycle, answered = 0, complete = 0, gated = 0, judged = 0, locked_at = -1, op_at = -1;
  long cycles = (long)(seconds * 1e9 / (double)config->cycle_ns);
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
    int64_t sent, took;
    int counter = 0;
    sleep_until(scheduled);

    /* The frame of the cycle before: in the socket's buffer by now. */
    if (cycle > 1) counter = ecx_receive_processdata(&context, EC_TIMEOUTRET);
    if (counter <= 0) frame.has_reference = 0;
    frame.reference_ns = context.DCtime;
    decision = ftcs_cycle_update(&servo, &frame, now_ns());

    /* Here the application computes its outputs. */

    sent = now_ns();
    ecx_send_processdata(&context);
    took = now_ns() - sent;
    frame.sent_ns = sent;
    frame.scheduled_ns = scheduled;
    frame.has_scheduled = 1;
    frame.has_reference = took < 2 * usual; /* else interrupted: nobody knows when it left */
    usual += (took - usual) / 64;

    if (counter > 0) ++answered;
    if (counter == expected) ++complete;
    if (decision.verdict != FTCS_CYCLE_USED) ++gated;
    if (decision.state != FTCS_CYCLE_LOCKED) continue;
    if (locked_at < 0) {
      locked_at = cycle;
      context.slavelist[0].state = EC_STATE_OPERATIONAL;
      ecx_writestate(&context, 0);
    }
    if (op_at < 0 && cycle % 100 == 0 &&
        ecx_statecheck(&context, 0, EC_STATE_OPERATIONAL, 0) == EC_STATE_OPERATIONAL) {
      op_at = cycle;
    }
    if (decision.verdict == FTCS_CYCLE_USED) phases[judged++] = (int32_t)decision.phase_error_ns;
  }
  printf("%s: %s, locked in cycle %ld, OP in cycle %ld, rate %+.3f ppm\n", kLaws[config->law],
         ftcs_cycle_state_name(decision.state), locked_at, op_at, decision.rate_ppb * 1e-3);
  printf("working counter %d in %ld of %ld frames that came back, %ld cycles; %ld cycles gated or lost\n",
         expected, complete, answered, cycles, gated);
  if (judged > 0) {
    long i;
    for (i = 0; i < judged; ++i) phases[i] = abs(phases[i]);
    qsort(phases, (size_t)judged, sizeof phases[0], compare);
    printf("|phase| of the virtual cycle since the lock: p50 %d p99 %d max %d ns\n",
           phases[judged / 2], phases[judged * 99 / 100], phases[judged - 1]);
  }
  return decision.state == FTCS_CYCLE_LOCKED && op_at > 0;
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
  config.cycle_ns = argc > 4 ? atoi(argv[4]) * 1000LL : 1000000;
  config.shift_ns = argc > 5 ? atoi(argv[5]) * 1000LL : config.cycle_ns / 2;
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
