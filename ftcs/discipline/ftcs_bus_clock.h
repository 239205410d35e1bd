/* SPDX-License-Identifier: MIT */
#ifndef FTCS_BUS_CLOCK_H
#define FTCS_BUS_CLOCK_H

/* Plant time for an EtherCAT segment: tells how far the distributed clock is from plant time, and
 * what to write so that it follows. For main devices in C: no heap, no system call, no C++ run-time
 * library. One bus clock belongs to one thread. Library: ftcs_cycle_servo.
 *
 * Once a cycle:
 *
 *   offset_ns in force -> send the frame: FRMW or FPRD of 0x0910, behind it FPWR of 0x0920 with
 *   (offset at the start + decision.offset_ns), 8 octets, to the reference SubDevice
 *   -> take it back -> ftcs_bus_update() with the system time, plant time at the same instant, and
 *   the offset_ns that was in force when the frame passed (that of the cycle before)
 *
 * The first alignment is the caller's: before SYNC0 starts, write 0x0920 of all SubDevices so that
 * system time is plant time. Afterwards nothing jumps. Where plant time comes from does not matter:
 * a PTP clock, CLOCK_TAI; it is read at the instant at which the frame passed the reference. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How the bus stands to plant time. */
enum ftcs_bus_state {
  FTCS_BUS_WAITING = 0, /* no plant time yet */
  FTCS_BUS_ACQUIRING = 1,
  FTCS_BUS_LOCKED = 2,
  FTCS_BUS_HOLDOVER = 3 /* plant time stays away: the last rate is kept */
};

enum ftcs_bus_error {
  FTCS_BUS_OK = 0,
  FTCS_BUS_BAD_STORAGE = 1, /* header and library were built differently */
  FTCS_BUS_BAD_TIME = 2,    /* cycle_ns, sample_interval_ns or time_constant_ns not above zero, the
                               interval shorter than the cycle, or one longer than an hour */
  FTCS_BUS_BAD_LIMIT = 3    /* limit_ppm, pull_ppm or slope_ppm_per_s not within (0, 100000), or
                               sync0_phase not within 0 to 1 */
};

/* Begin with ftcs_bus_default_config(). Valid ranges: enum ftcs_bus_error. */
typedef struct ftcs_bus_config {
  int64_t cycle_ns;           /* between two calls of ftcs_bus_update() */
  int64_t sample_interval_ns; /* of the cycles of so long a time the median is heard; 125 ms */
  int64_t time_constant_ns;   /* an offset is removed with it, where no limit binds; 500 ms */
  double sync0_phase;         /* SYNC0 comes this part of a cycle after the frame; 0.5 */
  double limit_ppm;           /* of the bus against the crystal of the reference; 400 */
  double pull_ppm;            /* beside the rate that tracks; 50 */
  double slope_ppm_per_s;     /* of any change of the rate; 100 */
  int32_t steer;              /* 0: the offset is told, nothing is moved */
} ftcs_bus_config;

/* What one cycle told. */
typedef struct ftcs_bus_sample {
  int32_t usable;    /* 1: all of it; 2: all but plant_ns, which is not known in this cycle; 0:
                        nothing, the frame was lost */
  int64_t dc_ns;     /* system time of the reference, 64 bits */
  int64_t plant_ns;  /* plant time at the same instant, on the same epoch */
  int64_t offset_ns; /* what had been added to 0x0920 when the system time was latched */
} ftcs_bus_sample;

/* What to write with the next frame, and how the bus stands. */
typedef struct ftcs_bus_decision {
  int64_t offset_ns;      /* to be added to 0x0920, in total since the start, by the next frame */
  int64_t dc_to_plant_ns; /* at SYNC0, filtered; positive: the bus is ahead; if `known` */
  double sigma_ns;        /* its standard deviation; grows in holdover */
  double rate_ppb;        /* what the bus is bent by at present */
  int32_t state;          /* enum ftcs_bus_state */
  int32_t known;
} ftcs_bus_decision;

#define FTCS_BUS_CLOCK_WORDS 3072
/* Opaque; may lie in static memory. */
typedef struct ftcs_bus_clock {
  uint64_t words[FTCS_BUS_CLOCK_WORDS];
} ftcs_bus_clock;

/* The defaults above, for a cycle of this length. */
ftcs_bus_config ftcs_bus_default_config(int64_t cycle_ns);
/* enum ftcs_bus_error; `storage_size` is sizeof(ftcs_bus_clock). Nothing else may be called before.
 */
int32_t ftcs_bus_init(ftcs_bus_clock* clock, size_t storage_size, const ftcs_bus_config* config);
/* Once in each cycle, usable or not. */
ftcs_bus_decision ftcs_bus_update(ftcs_bus_clock* clock, const ftcs_bus_sample* sample);
/* Plant time comes from somewhere else: what is known is void, the rate is kept. */
void ftcs_bus_new_plant_time(ftcs_bus_clock* clock);

#ifdef __cplusplus
}
#endif

#endif
