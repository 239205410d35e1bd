/* SPDX-License-Identifier: MIT */
/* A servo of your own in C: plain frequency tracking, paper eq. (18).
 *
 *   cc -std=c99 -shared -fPIC -O2 -o my_servo.so my_servo.c
 *   ftcs compare --servo ./my_servo.so --servo adaptive
 */
#include "ftcs/servo/ftcs_servo_plugin.h"

#include <math.h>
#include <stdlib.h>

struct servo {
  int heard; /* forward messages with a known path delay */
  ftcs_servo_observation last;
};

static double since(ftcs_servo_time then, ftcs_servo_time now) {
  return (double)(now.ns - then.ns) + (now.fraction_ns - then.fraction_ns);
}

static void* create(const ftcs_servo_setup* setup) {
  (void)setup;
  return calloc(1, sizeof(struct servo));
}

static void reset(void* instance) { ((struct servo*)instance)->heard = 0; }

static int32_t update(void* instance, const ftcs_servo_observation* seen, ftcs_servo_command* command) {
  struct servo* servo = instance;
  if (isnan(seen->offset_ns)) return FTCS_SERVO_HEARD; /* backward, or no path delay yet */
  const ftcs_servo_observation last = servo->last;
  servo->last = *seen;
  if (servo->heard++ == 0) return FTCS_SERVO_HEARD;
  /* k a = reference / free running over the last interval; then remove the offset within it. */
  const double interval = since(last.reference, seen->reference);
  const double ratio = interval / since(last.free_running, seen->free_running);
  command->tracking_rate_ppb = (ratio - 1.0) * 1e9;
  command->correction_rate_ppb = (ratio * (1.0 - seen->offset_ns / interval) - 1.0) * 1e9;
  command->correction_time_ns = interval;
  return FTCS_SERVO_COMMAND;
}

int32_t ftcs_servo_entry(uint32_t abi, ftcs_servo_functions* functions) {
  if (abi != FTCS_SERVO_ABI) return 1;
  *functions = (ftcs_servo_functions){FTCS_SERVO_ABI, "my-servo-c", create, free, reset, update, NULL};
  return 0;
}
