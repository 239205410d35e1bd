/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ADDEND_H
#define FTCS_ADDEND_H

/* The frequency-tracking clock servo of Chen et al., IEEE Access 5 (2017), for a clock with an
 * addend register (Fig. 2) whose own stamps are all there is: the time stamping unit of an Ethernet
 * MAC. C99, 64-bit integers, no heap, no library, no floating point; the same bits on every
 * machine.
 *
 * Sync received -> ftcs_addend_update() -> write command.addend -> when the clock shows
 * command.until_ns, write command.next_addend. Nothing else is needed: a lost Sync does no harm.
 *
 * Rates: the clock runs at addend / nominal_addend of its oscillator. W is the addend that tracks
 * the reference, tau_W what the clock would have shown at W(n), C the addend that corrects:
 *
 * W(n+1) = W(n) d tau_r / d tau_W, equations (12) and (13);
 *
 * C = (1 - p offset / T_c) W(n+1) for T_c, then W(n+1), equations (17) and (19);
 *
 * p = 1 outside the band B (18), and both limited to nominal (1 +- F). In quiet mode W and the
 * offset come from a memory that grows with the samples (expanding-memory polynomial filter of
 * degree one), up to quiet_memory samples and no further than the innovations stay white; it starts
 * as FTCS, in one interval.
 *
 * Times are int64 nanoseconds, fractions and the path delay are in 2^-16 ns as IEEE 1588-2019's
 * TimeInterval (5.3.2). Offsets are local minus reference. One servo belongs to one thread; where
 * an interrupt writes next_addend, see ftcs_addend_wrote_next(). */

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum ftcs_addend_verdict {
  FTCS_ADDEND_USED = 0,
  FTCS_ADDEND_DUPLICATE = 1,   /* newer than its predecessor on neither clock */
  FTCS_ADDEND_IMPLAUSIBLE = 2, /* a clock jumped, or 37 minutes went by: starts again from here */
  FTCS_ADDEND_STALE = 3,   /* stamped before the last command was written: says nothing about it */
  FTCS_ADDEND_REJECTED = 4 /* quiet mode: unlike its neighbours; the second in a row is believed */
};

enum ftcs_addend_state {
  FTCS_ADDEND_WAITING = 0, /* less than two samples */
  FTCS_ADDEND_ACQUIRING = 1,
  FTCS_ADDEND_LOCKED =
      2, /* the offset came below lock_enter_ns and has not reached lock_leave_ns since */
  FTCS_ADDEND_COASTING = 3 /* no sample for more than four intervals; the tracking rate is kept */
};

enum ftcs_addend_error {
  FTCS_ADDEND_OK = 0,
  FTCS_ADDEND_BAD_NOMINAL =
      1, /* zero, or nominal (1 + plausible) or nominal (1 + F) does not fit 32 bits */
  FTCS_ADDEND_BAD_LIMIT = 2, /* limit_ppm or plausible_ppm not within [1, 500000] */
  FTCS_ADDEND_BAD_GAIN = 3,  /* above 65536 */
  FTCS_ADDEND_BAD_BAND =
      4, /* band_leave_ns below band_enter_ns, or lock_leave_ns below lock_enter_ns */
  FTCS_ADDEND_BAD_TIME =
      5, /* negative, 2^41 ns (37 minutes) or more (step_ns: 2^28 ns), or T_c longer than T */
  FTCS_ADDEND_BAD_MEMORY = 6, /* a filter with a quiet_memory below 8 or above 255 */
  FTCS_ADDEND_BAD_ADDEND = 7, /* addend_now outside nominal (1 +- F) */
  FTCS_ADDEND_BAD_OPTION = 8  /* a filter, a step or no_timer, built with FTCS_ADDEND_BARE */
};

/* As band: every offset lies inside. So does it where a threshold is above 2^28 ns (0.27 s). */
#define FTCS_ADDEND_UNBOUNDED UINT32_MAX

struct ftcs_addend_servo;

/* Private, but for its name: what the rate is taken from. Zero rejects the sample. */
typedef int32_t (*ftcs_addend_filter)(struct ftcs_addend_servo* servo, int64_t shown,
                                      int64_t* ahead);

/* Must outlive the servo: a constant in flash. */
typedef struct ftcs_addend_config {
  uint32_t nominal_addend; /* of rate 1: 2^32 / (oscillator frequency * increment); see
                              actuators/addend32.h */
  uint32_t limit_ppm;      /* [F] */
  uint32_t plausible_ppm;  /* a measured rate further from nominal is a jump */
  uint32_t gain_q16;       /* [p] inside the band, 65536 is 1 */
  uint32_t band_enter_ns;  /* [B] entered below, ... */
  uint32_t band_leave_ns;  /* ... left at this offset */
  uint32_t lock_enter_ns;
  uint32_t lock_leave_ns;
  uint32_t step_ns; /* the first action steps the clock if the offset is that large; zero: never */
  int64_t interval_ns;   /* [T_sync] zero: measured, the shorter of the last two gaps */
  int64_t correction_ns; /* [T_c] zero: T_sync */
  uint16_t dwell; /* consecutive offsets inside the band, after the first action, before p holds */
  uint16_t quiet_memory; /* of the filter, in samples, 8 to 255 */
  uint32_t
      no_timer; /* non-zero: nobody writes next_addend, a correction holds until the next command */
  ftcs_addend_filter filter; /* zero: FTCS; ftcs_addend_quiet: quiet mode */
} ftcs_addend_config;

typedef struct ftcs_addend_sample {
  int64_t origin_ns; /* t1 + correction: reference */
  int64_t local_ns;  /* t2: receive stamp of the steered clock */
  int64_t
      now_ns; /* reading of the steered clock for which the write is planned, not before local_ns */
  int64_t path_delay_scaled; /* mean path delay in 2^-16 ns */
  uint16_t origin_fraction;  /* 2^-16 ns */
  uint16_t local_fraction;
} ftcs_addend_sample;

typedef struct ftcs_addend_command {
  int32_t verdict;      /* enum ftcs_addend_verdict */
  int32_t state;        /* enum ftcs_addend_state, never COASTING here */
  int32_t act;          /* zero: leave the registers alone */
  uint32_t addend;      /* write now (after the step, if there is one) */
  uint32_t next_addend; /* write this when ... */
  uint32_t
      deviation_ns;  /* standard deviation of the offsets, or in quiet mode of the innovations */
  int64_t until_ns;  /* ... the clock shows this; INT64_MAX with no_timer */
  int64_t step_ns;   /* add this to the clock first; zero without config.step_ns */
  int64_t offset_ns; /* of the sample, local minus reference */
} ftcs_addend_command;

/* A number r of magnitude at most 4 as m 2^-(29 + shift), |m| < 2^31: m in the upper half, the
 * shift (0 to 63) in the lower. Private. */
typedef int64_t ftcs_addend_ratio;

/* One servo; its content is private. */
typedef struct ftcs_addend_servo {
  const ftcs_addend_config* config;
  uint32_t addend;     /* W(n), tracking */
  uint32_t correction; /* C(n) */
  uint32_t slowest;    /* addends: F */
  uint32_t fastest;
  uint32_t lowest; /* addends: plausible */
  uint32_t highest;
  int32_t fraction;   /* wanted minus written tracking addend, 2^-16 */
  uint32_t deviation; /* mean of magnitudes, 1/16 ns */
  uint16_t phase;
  uint16_t locked;
  uint16_t inside; /* offsets below band_enter_ns in a row */
  uint16_t memory; /* samples the filter remembers */
  uint16_t origin_fraction;
  uint16_t local_fraction;
  int16_t whiteness; /* mean product of the signs of successive innovations, 256 is 1 */
  uint16_t last;     /* innovation: its sign, and whether it was doubted */
  uint32_t near;     /* 2^10 ns: for no longer than that `bend` is near enough */
  int64_t origin_ns; /* of the last sample */
  int64_t local_ns;
  int64_t interval; /* between the last two samples, 2^-16 ns; zero: there were none */
  int64_t start_ns; /* the correction began when the clock showed this, ... */
  int64_t until_ns; /* ... and ends when it shows this */
  int64_t expected; /* local minus origin from then on, if the oscillator stays as it is: 2^-16 ns,
                       modulo 2^64 */
  ftcs_addend_ratio bend; /* W / C - 1 */
  int64_t residue;        /* filtered minus measured reference of the last sample */
} ftcs_addend_servo;

/* FTCS with the defaults of the C++ servo: p = 1/16, B unbounded, F and plausible rates +- 50 % or
 * what fits 32 bits, lock at 1 us, left at 5 us, nothing steps. */
ftcs_addend_config ftcs_addend_default_config(uint32_t nominal_addend);

/* The same in quiet mode: p = 1, a memory of at most 64 samples. */
ftcs_addend_config ftcs_addend_quiet_config(uint32_t nominal_addend);

/* For config.filter; with it in no configuration, the linker leaves quiet mode out. */
int32_t ftcs_addend_quiet(ftcs_addend_servo* servo, int64_t shown, int64_t* ahead);

/* `addend_now` is what the register holds. Returns an enum ftcs_addend_error; the servo is usable
 * after FTCS_ADDEND_OK. */
int32_t ftcs_addend_init(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                         uint32_t addend_now);

/* The same for a configuration that has been found good, by ftcs_addend_init() in a test or as a
 * program starts: 200 bytes less. */
void ftcs_addend_start(ftcs_addend_servo* servo, const ftcs_addend_config* config,
                       uint32_t addend_now);

/* Everything measured is void: the next command comes with the second sample. The register is left
 * alone. */
void ftcs_addend_reset(ftcs_addend_servo* servo);

/* Takes a first sample without acting, e.g. from before the path delay was known (k(n) needs none).
 * No effect unless the servo is empty. */
void ftcs_addend_prime(ftcs_addend_servo* servo, const ftcs_addend_sample* sample);

/* The command of one sample; it is taken as obeyed at now_ns and until_ns. */
void ftcs_addend_take(ftcs_addend_servo* servo, const ftcs_addend_sample* sample,
                      ftcs_addend_command* command);

/* The same as a value. */
static inline ftcs_addend_command ftcs_addend_update(ftcs_addend_servo* servo,
                                                     const ftcs_addend_sample* sample) {
  ftcs_addend_command command;
  ftcs_addend_take(servo, sample, &command);
  return command;
}

/* What really happened, if it differs: the registers were written when the clock showed `at_ns`,
 * with addends that the actuator could realise. Call before the next sample. */
void ftcs_addend_wrote(ftcs_addend_servo* servo, int64_t at_ns, uint32_t addend,
                       uint32_t next_addend);

/* next_addend was written when the clock showed `at_ns`, not at until_ns: an interrupt came late.
 */
void ftcs_addend_wrote_next(ftcs_addend_servo* servo, int64_t at_ns);

/* Somebody else stepped the clock: by_ns was added to it. Not for command.step_ns, which the servo
 * knows of. */
void ftcs_addend_stepped(ftcs_addend_servo* servo, int64_t by_ns);

/* Reference time from the last sample's receive stamp to a later reading of the steered clock, in
 * 2^-16 ns: a correction bends the clock's own time by up to F, which a path delay (t3 - t2) must
 * not contain. */
int64_t ftcs_addend_elapsed(const ftcs_addend_servo* servo, int64_t local_ns);

/* enum ftcs_addend_state at a reading of the steered clock. */
int32_t ftcs_addend_state_at(const ftcs_addend_servo* servo, int64_t now_ns);

/* What the oscillator has to be sped up by to follow the reference, in parts per billion of
 * nominal. */
int32_t ftcs_addend_rate_ppb(const ftcs_addend_servo* servo);

/* "waiting", "acquiring", "locked", "coasting". */
const char* ftcs_addend_state_name(int32_t state);

#ifdef __cplusplus
}
#endif

#endif
