/* SPDX-License-Identifier: MIT */
#ifndef FTCS_SERVO_PLUGIN_H
#define FTCS_SERVO_PLUGIN_H

/* A clock servo of your own in the tables of `ftcs compare`, `ftcs simulate` and `ftcs paper`:
 * observations in, command out.
 *
 * A shared library exports ftcs_servo_entry(), which fills the table of functions; the program is
 * given it as `--servo ./my_servo.so`. Runs are spread over threads: each has an instance of its
 * own, and no function may keep anything outside its instance. The same observations must lead to
 * the same commands: a table that cannot be repeated says nothing.
 *
 * Three clocks: the reference; the free-running oscillator, which nobody steers; and the local
 * clock, which runs on it and is what the servo steers. Rates are local time per free-running time
 * as a deviation from 1 in ppb. Offsets are local minus reference, positive when local is ahead. */

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FTCS_SERVO_ABI 1u

/* An instant, ns since the epoch of its own clock: whole, and a fraction of 0 to less than 1. */
typedef struct ftcs_servo_time {
  int64_t ns;
  double fraction_ns;
} ftcs_servo_time;

/* What is known before the first message. */
typedef struct ftcs_servo_setup {
  int64_t sync_interval_ns; /* 0: not told */
  double lowest_rate_ppb;   /* what the clock can do; above -1e9 */
  double highest_rate_ppb;
  double path_delay_ns; /* known otherwise, then no backward messages are needed; NaN: to measure */
} ftcs_servo_setup;

enum ftcs_servo_direction {
  FTCS_SERVO_FORWARD = 0, /* reference to local, as Sync: reference = t1, local = t2 */
  FTCS_SERVO_BACKWARD = 1 /* local to reference, as Delay_Req: local = t3, reference = t4 */
};

/* One message. Corrections are in its stamps. */
typedef struct ftcs_servo_observation {
  int32_t direction;
  int32_t reserved;
  ftcs_servo_time reference;
  ftcs_servo_time local;        /* what the steered clock showed at the stamp */
  ftcs_servo_time free_running; /* what the oscillator showed at the stamp */
  ftcs_servo_time now_local;    /* both clocks when the command will be applied */
  ftcs_servo_time now_free_running;
  double path_delay_ns; /* mean path delay: median of the last exchanges; NaN until measured */
  double offset_ns;     /* forward: local - (reference + path delay), noise included; else NaN */
} ftcs_servo_observation;

/* From the moment it is applied the clock runs at correction_rate for correction_time_ns of
 * reference time, then at tracking_rate until the next command. Paper, eq. (17): correction
 * (1 + p T_offset / T_c) k a, tracking k a. correction_time_ns = 0: tracking_rate at once. Rates
 * outside the clock's limits are cut to them. Zeroes on entry. */
typedef struct ftcs_servo_command {
  double correction_rate_ppb;
  double correction_time_ns;
  double tracking_rate_ppb;
  double step_ns; /* added to the clock first, where the scenario permits a step; 0: none */
} ftcs_servo_command;

/* What update() returns. */
enum ftcs_servo_result {
  FTCS_SERVO_HEARD = 0,    /* no command: the clock goes on as it was told */
  FTCS_SERVO_COMMAND = 1,  /* *command holds the next command */
  FTCS_SERVO_REJECTED = 2, /* taken for an outlier; counted; no command */
};

/* What the servo believes, for tables of stated deviations. NaN on entry: not known. */
typedef struct ftcs_servo_belief {
  double offset_ns;       /* of the local clock, filtered */
  double offset_sigma_ns; /* its standard deviation */
  double rate_ppb;        /* reference per free-running time: the rate that tracks */
} ftcs_servo_belief;

/* create: an instance, or a null pointer where there is no memory. destroy: its end. reset: another
 * reference; what was learnt about the old one is void. believe: optional, null where there is
 * none. All others are needed. */
typedef struct ftcs_servo_functions {
  uint32_t abi;     /* FTCS_SERVO_ABI */
  const char* name; /* in the tables; lives as long as the library; null: the file's name */
  void* (*create)(const ftcs_servo_setup* setup);
  void (*destroy)(void* servo);
  void (*reset)(void* servo);
  int32_t (*update)(void* servo, const ftcs_servo_observation* seen, ftcs_servo_command* command);
  void (*believe)(const void* servo, ftcs_servo_belief* belief);
} ftcs_servo_functions;

/* Exported by the library. `abi` is the program's FTCS_SERVO_ABI. 0: filled; else it cannot work
 * with this program. */
int32_t ftcs_servo_entry(uint32_t abi, ftcs_servo_functions* functions);

#ifdef __cplusplus
}
#endif

#endif
