/* SPDX-License-Identifier: MIT */
/* The clock of an STM32F4's Ethernet MAC at 168 MHz, steered by ftcs_addend; registers by address
 * (RM0090, 33.8.3). Compiled for a Cortex-M4 by `make test-embedded`, not run on silicon. Your PTP
 * stack calls ptp_clock_sync() for each Sync. */
#include "actuators/addend32.h"
#include "ftcs_addend.h"

#define ETH_PTP ((volatile uint32_t*)0x40028700U)
enum { TSCR = 0, SSIR = 1, TSHR = 2, TSLR = 3, TSHUR = 4, TSLUR = 5, TSAR = 6, TTHR = 7, TTLR = 8 };
enum { TSE = 1, TSFCU = 2, TSSTI = 4, TSSTU = 8, TSITE = 16, TSARU = 32, TSSSR = 512 };

#define HCLK_HZ 168000000U
#define INCREMENT_NS 20U
#define NOMINAL 0x4C30C30CU /* ftcs_addend32_nominal(HCLK_HZ, INCREMENT_NS) */

static const ftcs_addend_config config = {
    .nominal_addend = NOMINAL,
    .limit_ppm = 100000,
    .plausible_ppm = 100000,
    .gain_q16 = 65536,
    .band_enter_ns = FTCS_ADDEND_UNBOUNDED,
    .band_leave_ns = FTCS_ADDEND_UNBOUNDED,
    .lock_enter_ns = 1000,
    .lock_leave_ns = 5000,
    .step_ns = 1000000, /* a first offset of a millisecond or more is stepped */
    .dwell = 1,
    .filter = ftcs_addend_quiet,
    .quiet_memory = 64,
};
static ftcs_addend_servo servo;
static const ftcs_addend32 mac = {&ETH_PTP[TSAR], &ETH_PTP[TSCR], &ETH_PTP[TTHR],
                                  &ETH_PTP[TTLR], TSARU,          TSITE};
static volatile uint32_t next_addend;

/* Zero: the configuration fits this clock. */
int32_t ptp_clock_start(void) {
  ETH_PTP[SSIR] = INCREMENT_NS;
  ETH_PTP[TSAR] = NOMINAL;
  ETH_PTP[TSCR] = TSE | TSFCU | TSSSR | TSARU;
  return ftcs_addend_init(&servo, &config, NOMINAL);
}

int64_t ptp_clock_now(void) {
  uint32_t seconds;
  uint32_t nanoseconds;
  do { /* the two halves belong together if the seconds did not move on in between */
    seconds = ETH_PTP[TSHR];
    nanoseconds = ETH_PTP[TSLR];
  } while (seconds != ETH_PTP[TSHR]);
  return (int64_t)seconds * 1000000000 + nanoseconds;
}

static void step(int64_t by_ns) {
  const uint64_t size = by_ns < 0 ? 0U - (uint64_t)by_ns : (uint64_t)by_ns;
  ETH_PTP[TSHUR] = (uint32_t)(size / 1000000000U);
  ETH_PTP[TSLUR] = (uint32_t)(size % 1000000000U) | (by_ns < 0 ? 0x80000000U : 0U);
  ETH_PTP[TSCR] = ETH_PTP[TSCR] | TSSTU;
}

/* t1 plus correction, t2 of this clock, mean path delay in 2^-16 ns. Returns an enum
 * ftcs_addend_state. */
int32_t ptp_clock_sync(int64_t origin_ns, int64_t receive_ns, int64_t path_delay_scaled) {
  const ftcs_addend_sample sample = {origin_ns,         receive_ns, ptp_clock_now(),
                                     path_delay_scaled, 0,          0};
  const ftcs_addend_command command = ftcs_addend_update(&servo, &sample);
  if (command.act != 0) {
    if (command.step_ns != 0) step(command.step_ns);
    next_addend = command.next_addend;
    while (ftcs_addend32_write(&mac, command.addend) == 0) { /* a few cycles of the MAC's clock */
    }
    ftcs_addend32_alarm(&mac, command.until_ns);
  }
  return command.state;
}

/* From the MAC's interrupt, when the target time is reached: the correction is over. */
void ptp_clock_alarm(void) { (void)ftcs_addend32_write(&mac, next_addend); }
