/* SPDX-License-Identifier: MIT */
/* A C99 program with a cycle of 1 ms whose host clock is 50 ppm slow: the servo must lock, find the
 * rate and keep the phase. No C++ anywhere. */
#include <stdio.h>
#include <stdlib.h>

#include "ftcs/discipline/ftcs_cycle_servo.h"

/* The reference shows 1.00005 times the host's time, and started elsewhere. */
static int64_t reference_at(int64_t host_ns) { return 700000000123LL + host_ns + host_ns / 20000; }

/* Lateness of the wake-up: 20 to 83 us, and once in a while 400 us. */
static int64_t lateness(int cycle) {
  if (cycle % 97 == 50) return 400000;
  return 20000 + (cycle * 7919) % 63000;
}

/* The loop of SOEM's samples, IgH and LinuxCNC: a frame is taken back when the next cycle begins.
 * With 32-bit latches. */
static int run_a_cycle_behind(int32_t law) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_cycle_decision decision;
  ftcs_cycle_sample frame = {0};
  int64_t reference = 0;
  int cycle;
  config.law = law;
  config.cycles_per_sync = 100;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return 1;
  decision = ftcs_cycle_start(&servo, 5000000);
  for (cycle = 0; cycle < 6000; ++cycle) {
    const int64_t scheduled = decision.wake_ns;
    const int64_t awake = scheduled + lateness(cycle);
    decision = ftcs_cycle_update(&servo, &frame, awake);
    if (decision.wake_ns <= awake || decision.skipped != 0) return 1;
    frame.sent_ns = awake + 9000;
    frame.scheduled_ns = scheduled;
    frame.has_scheduled = 1;
    frame.has_reference = cycle % 20 != 7;
    reference = ftcs_cycle_unwrap(reference, (uint32_t)reference_at(frame.sent_ns));
    frame.reference_ns = reference;
  }
  printf("a cycle behind, %s: phase %lld ns, rate %.1f ppb\n",
         ftcs_cycle_state_name(decision.state), (long long)decision.phase_error_ns,
         decision.rate_ppb);
  if (decision.state != FTCS_CYCLE_LOCKED) return 1;
  if (llabs((long long)decision.phase_error_ns) > 200) return 1;
  return decision.rate_ppb < 49900 || decision.rate_ppb > 50100;
}

static int run(int32_t law) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  ftcs_cycle_decision decision;
  int cycle;
  config.law = law;
  config.cycles_per_sync = 100;
  config.shift_ns = 250000;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return 1;
  decision = ftcs_cycle_start(&servo, 5000000);
  for (cycle = 0; cycle < 2000; ++cycle) {
    ftcs_cycle_sample sample;
    sample.has_reference = cycle % 20 != 7; /* one frame in twenty is lost */
    sample.has_scheduled = 0;
    sample.sent_ns = decision.wake_ns + lateness(cycle);
    sample.reference_ns = reference_at(sample.sent_ns);
    sample.has_received = 1;
    sample.received_ns = sample.sent_ns + 60000;
    decision = ftcs_cycle_update(&servo, &sample, sample.received_ns + 5000);
  }
  printf("%s: phase %lld ns, rate %.1f ppb\n", ftcs_cycle_state_name(decision.state),
         (long long)decision.phase_error_ns, decision.rate_ppb);
  if (decision.state != FTCS_CYCLE_LOCKED) return 1;
  if (llabs((long long)decision.phase_error_ns) > 200) return 1;
  if (decision.rate_ppb < 49900 || decision.rate_ppb > 50100) return 1;
  /* The next wake-up stands at a whole multiple of the cycle plus the shift. */
  {
    const int64_t phase = (reference_at(decision.wake_ns) - config.shift_ns) % config.cycle_ns;
    if (phase > 300 && phase < config.cycle_ns - 300) return 1;
  }
  return 0;
}

int main(void) {
  static ftcs_cycle_servo servo;
  ftcs_cycle_config config = ftcs_cycle_default_config();
  int failed = run(FTCS_CYCLE_FTCS) + run(FTCS_CYCLE_PICS);
  failed += run_a_cycle_behind(FTCS_CYCLE_FTCS) + run_a_cycle_behind(FTCS_CYCLE_PICS);
#ifdef FTCS_CYCLE_WITHOUT_ADAPTIVE
  config.law = FTCS_CYCLE_ADAPTIVE;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_LAW;
#else
  failed += run(FTCS_CYCLE_ADAPTIVE) + run_a_cycle_behind(FTCS_CYCLE_ADAPTIVE);
#endif
  config = ftcs_cycle_default_config();
  failed += ftcs_cycle_init(&servo, sizeof servo / 2, &config) != FTCS_CYCLE_BAD_STORAGE;
  config.cycle_ns = 0;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_CYCLE;
  config.cycle_ns = 7200000000000LL;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_CYCLE;
  config = ftcs_cycle_default_config();
  config.cycles_per_sync = 0xFFFFFFFFU;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_CYCLE;
  config = ftcs_cycle_default_config();
  config.offset_gain = 1.5;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_GAIN;
  config = ftcs_cycle_default_config();
  config.lock_leave_ns = config.lock_enter_ns - 1;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_LIMIT;
  config = ftcs_cycle_default_config();
  config.shift_ns = INT64_MIN;
  failed += ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_BAD_LIMIT;
  failed += ftcs_cycle_unwrap(0x1FFFFFFF0LL, 0x10) != 0x200000010LL;
  failed += ftcs_cycle_unwrap(0x200000010LL, 0xFFFFFFF0U) != 0x1FFFFFFF0LL;
  return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
