/* SPDX-License-Identifier: MIT */
/* A cyclic task of 1 ms that follows a reference clock with each law in turn: runs anywhere, as any user.
 *
 *   standalone_cycle [LAW [SECONDS]]      LAW: ftcs, pics, adaptive, none
 *
 * The frames and the reference are simulated: a clock 50 ppm faster than the host's CLOCK_MONOTONIC is
 * read when a "frame" is sent. The task's lateness is the host's own. Exit code 1: not locked. */
#define _POSIX_C_SOURCE 200809L

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/monotonic.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"

static const char* const kLaws[] = {"none", "ftcs", "pics", "adaptive"};

/* What the reference SubDevice would latch from a frame that is sent at an instant of the host. */
static int64_t reference_at(int64_t host_ns) { return 848614739450471667 + host_ns + host_ns / 20000; }

/* How far a wake-up lies from the nearest whole cycle of the reference, ns; late is positive. */
static int64_t true_phase(int64_t wake_ns, int64_t cycle_ns) {
  const int64_t phase = reference_at(wake_ns) % cycle_ns;
  return phase > cycle_ns / 2 ? phase - cycle_ns : phase;
}

static int run(int32_t law, double seconds) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_cycle_decision decision;
  int64_t start, worst = 0, cycles = 0, gated = 0, locked_at = -1;

  config.law = law;
  config.cycles_per_sync = 200; /* FTCS and PICS act five times a second */
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return 1;
  start = now_ns();
  decision = ftcs_cycle_start(&servo, start);
  while (now_ns() - start < (int64_t)(seconds * 1e9)) {
    ftcs_cycle_sample sample;
    memset(&sample, 0, sizeof sample);
    sleep_until(decision.wake_ns);
    sample.sent_ns = now_ns();
    sample.reference_ns = reference_at(sample.sent_ns);
    sample.has_reference = 1;
    sample.received_ns = now_ns();
    sample.has_received = 1;
    decision = ftcs_cycle_update(&servo, &sample, now_ns());

    ++cycles;
    if (decision.verdict != FTCS_CYCLE_USED) ++gated;
    if (decision.state != FTCS_CYCLE_LOCKED) continue;
    if (locked_at < 0) locked_at = cycles;
    if (llabs(true_phase(decision.wake_ns, config.cycle_ns)) > worst) {
      worst = llabs(true_phase(decision.wake_ns, config.cycle_ns));
    }
  }
  if (locked_at < 0) {
    printf("%-9s not locked, %s, after %lld cycles\n", kLaws[law],
           ftcs_cycle_state_name(decision.state), (long long)cycles);
    return 1;
  }
  printf("%-9s locked after %lld cycles of %.3f ms; rate %+.3f ppm (true +50); wake-up then at most "
         "%lld ns off; %lld of %lld cycles gated\n",
         kLaws[law], (long long)locked_at, (double)config.cycle_ns * 1e-6, decision.rate_ppb * 1e-3,
         (long long)worst, (long long)gated, (long long)cycles);
  return 0;
}

int main(int argc, char** argv) {
  const double seconds = argc > 2 ? atof(argv[2]) : 1.5;
  int failed = 0;
  int32_t law;
  if (argc < 2) {
    for (law = FTCS_CYCLE_FTCS; law <= FTCS_CYCLE_ADAPTIVE; ++law) failed += run(law, seconds);
    return failed != 0;
  }
  for (law = FTCS_CYCLE_NONE; law <= FTCS_CYCLE_ADAPTIVE; ++law) {
    if (strcmp(argv[1], kLaws[law]) == 0) return run(law, seconds);
  }
  fprintf(stderr, "standalone_cycle: '%s' is none of none, ftcs, pics, adaptive\n", argv[1]);
  return 2;
}
