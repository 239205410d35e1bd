/* SPDX-License-Identifier: MIT */
#ifndef FTCS_CYCLE_SERVO_H
#define FTCS_CYCLE_SERVO_H

/* Keeps a cyclic task in phase with the distributed clock of an EtherCAT segment (or any reference
 * that only the task's own frames can read). For main devices in C: no heap, no system call, no C++
 * run-time library. One servo belongs to one thread.
 *
 *   wake up at decision.wake_ns -> note the time -> send the frame (FRMW or FPRD of 0x0910)
 *   -> take it back -> ftcs_cycle_update() -> wake up at decision.wake_ns ...
 *
 * Loops that take a frame back only when the next cycle begins (SOEM's, IgH's and LinuxCNC's do)
 * say which wake-up the frame belonged to: has_scheduled and scheduled_ns.
 *
 * All host times are nanoseconds of one clock that nobody steers (CLOCK_MONOTONIC or
 * CLOCK_MONOTONIC_RAW; the one that the wake-up uses). Reference times are the system time of the
 * reference SubDevice, 64 bits; ftcs_cycle_unwrap() makes them of 32-bit latches.
 *
 * In full:
 *
 *   static ftcs_cycle_servo servo;                       // 21 KB; 2 KB of the small one
 *   ftcs_cycle_config config = ftcs_cycle_default_config();
 *   if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK) return 1;
 *   ftcs_cycle_decision next = ftcs_cycle_start(&servo, now_ns());
 *   for (;;) {
 *     sleep_until_ns(next.wake_ns);
 *     ftcs_cycle_sample seen = {0};
 *     seen.sent_ns = now_ns();
 *     seen.has_reference = exchange_frame(&seen.reference_ns);
 *     next = ftcs_cycle_update(&servo, &seen, now_ns());
 *   }
 *
 * Equations: Chen et al., IEEE Access 5 (2017), Section V, eq. 25 (FTCS) and 26 (PICS). E(n), the
 * phase error, is positive when the cycle comes early; k(n) is reference time over host time
 * between two samples; p is 1 outside the band, offset_gain inside.
 *
 * Library: ftcs_cycle_servo (all laws) or, with FTCS_CYCLE_WITHOUT_ADAPTIVE defined before this
 * header, ftcs_cycle_servo_small (FTCS and PICS; does not need libm). */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum ftcs_cycle_law {
  FTCS_CYCLE_NONE = 0,    /* phase and lock are reported, nothing is steered */
  FTCS_CYCLE_FTCS = 1,    /* frequency tracking, eq. 25 of the paper */
  FTCS_CYCLE_PICS = 2,    /* incremental PI, eq. 26 */
  FTCS_CYCLE_ADAPTIVE = 3 /* every cycle, learns the noise; nothing to tune */
};

enum ftcs_cycle_state {
  FTCS_CYCLE_WAITING = 0,   /* no reference time yet */
  FTCS_CYCLE_ACQUIRING = 1, /* followed; not yet lock_cycles within lock_enter_ns, or the rate is
                               not known yet */
  FTCS_CYCLE_LOCKED = 2,    /* until a phase is lock_leave_ns off or more */
  FTCS_CYCLE_COASTING = 3   /* was locked; no usable frame for coast_limit cycles */
};

/* What became of the last frame. */
enum ftcs_cycle_verdict {
  FTCS_CYCLE_USED = 0,
  FTCS_CYCLE_LOST = 1,       /* has_reference was zero */
  FTCS_CYCLE_LATE = 2,       /* sent later than largest_lateness_ns after the wake-up asked for */
  FTCS_CYCLE_SLOW = 3,       /* under way longer than largest_round_trip_ns */
  FTCS_CYCLE_IMPOSSIBLE = 4, /* the reference jumped */
  FTCS_CYCLE_DOUBTFUL = 5    /* a phase unlike its neighbours': asked again in the next cycle, the
                                fifth in a row is believed */
};

/* What ftcs_cycle_init() found wrong first. */
enum ftcs_cycle_error {
  FTCS_CYCLE_OK = 0,
  FTCS_CYCLE_BAD_STORAGE = 1, /* header and library were built differently */
  FTCS_CYCLE_BAD_LAW = 2,     /* unknown, or the adaptive one is not in this library */
  FTCS_CYCLE_BAD_CYCLE = 3,   /* cycle_ns, resolution_ns or cycles_per_sync not above zero, or the
                                 cycle or the sync interval longer than an hour */
  FTCS_CYCLE_BAD_GAIN = 4,    /* not finite, negative, or offset_gain above 1 */
  FTCS_CYCLE_BAD_LIMIT = 5    /* limit_ppm not within (0, 500000), a negative bound, lock_leave_ns
                                 below lock_enter_ns, shift or transit beyond an hour */
};

/* Begin with ftcs_cycle_default_config() and change what is yours: mostly cycle_ns and shift_ns.
 * Valid ranges: enum ftcs_cycle_error. */
typedef struct ftcs_cycle_config {
  int32_t law;              /* enum ftcs_cycle_law */
  int32_t align_at_start;   /* non-zero: the first frame moves the wake-up onto its phase */
  int64_t cycle_ns;         /* in reference time */
  int64_t shift_ns;         /* wake up so long after the whole multiples of cycle_ns */
  int64_t resolution_ns;    /* of the timer that wakes the task */
  uint32_t cycles_per_sync; /* FTCS, PICS: act once in so many cycles */
  uint32_t lock_cycles;     /* consecutive cycles within lock_enter_ns that make a lock */
  double offset_gain;       /* FTCS: p within band_ns; beyond it 1 */
  int64_t band_ns;          /* FTCS: B */
  double proportional_gain; /* PICS: k_p and k_i times cycles_per_sync; 1 and 1 is deadbeat */
  double integral_gain;
  double limit_ppm;            /* F: how far a cycle may be bent */
  int64_t transit_ns;          /* from sent_ns to the latch in the reference */
  int64_t largest_lateness_ns; /* gates; zero: none */
  int64_t largest_round_trip_ns;
  int64_t lock_enter_ns;
  int64_t lock_leave_ns;
  uint32_t coast_limit; /* cycles without a usable frame before COASTING */
  uint32_t reserved;
} ftcs_cycle_config;

/* What the frame of one cycle told. Set to zero first. */
typedef struct ftcs_cycle_sample {
  int32_t has_reference; /* zero: the frame was lost */
  int32_t has_received;  /* zero: received_ns is unknown, no frame is called slow */
  int32_t has_scheduled; /* zero: the frame belongs to the wake-up that was last asked for */
  int32_t reserved;
  int64_t reference_ns; /* latch of the system time, 64 bits, no wrap */
  int64_t sent_ns;      /* as close to the wire as there is a stamp */
  int64_t received_ns;
  int64_t scheduled_ns; /* decision.wake_ns of the cycle that sent the frame */
} ftcs_cycle_sample;

/* What to do next, and how it stands. phase_error_ns is that of the last good frame. */
typedef struct ftcs_cycle_decision {
  int64_t wake_ns;        /* of the next cycle, a multiple of resolution_ns */
  int64_t phase_error_ns; /* positive: the cycle comes early; lateness and rounding taken off */
  int64_t lateness_ns;    /* sent_ns minus the wake-up that was asked for */
  double rate_ppb;        /* of the reference against the host */
  uint64_t skipped;       /* cycles that a stall passed over */
  int32_t state;          /* enum ftcs_cycle_state */
  int32_t verdict;        /* enum ftcs_cycle_verdict */
  int32_t commanded;      /* non-zero: the law acted on this cycle */
  int32_t reserved;
} ftcs_cycle_decision;

#ifdef FTCS_CYCLE_WITHOUT_ADAPTIVE
#define FTCS_CYCLE_WORDS 288
#else
#define FTCS_CYCLE_WORDS 2688
#endif
/* Storage of one servo; its content is private. May be copied and compared as bytes. */
typedef struct ftcs_cycle_servo {
  uint64_t words[FTCS_CYCLE_WORDS];
} ftcs_cycle_servo;

/* FTCS, cycle of 1 ms, sync interval of 500 cycles, timer of 1 ns, gates of 200 us. */
ftcs_cycle_config ftcs_cycle_default_config(void);
/* Returns an enum ftcs_cycle_error; call as ftcs_cycle_init(&servo, sizeof servo, &config). On an
 * error the storage is as it was, and no other function may be called. May be called again: all is
 * begun anew. */
int32_t ftcs_cycle_init(ftcs_cycle_servo* servo, size_t servo_size,
                        const ftcs_cycle_config* config);
/* The first wake-up: one cycle from now. The phase is not known yet. */
ftcs_cycle_decision ftcs_cycle_start(ftcs_cycle_servo* servo, int64_t now_ns);
/* A cycle is over; now_ns must lie before the next wake-up, else cycles are skipped. To be called
 * in each cycle, with has_reference = 0 where the frame was lost. The adaptive law costs about 2 us
 * a cycle on a PC, the others less (docs/cycle-servo.md). */
ftcs_cycle_decision ftcs_cycle_update(ftcs_cycle_servo* servo, const ftcs_cycle_sample* sample,
                                      int64_t now_ns);
/* The 64-bit time next to `previous_ns` whose lower half is `low`: less than 2.1 s between calls.
 */
int64_t ftcs_cycle_unwrap(int64_t previous_ns, uint32_t low);
/* "waiting", "acquiring", "locked", "coasting". */
const char* ftcs_cycle_state_name(int32_t state);

#ifdef __cplusplus
}
#endif

#endif
