/* SPDX-License-Identifier: MIT */
#ifndef FTCS_ACTUATOR_ADDEND32_H
#define FTCS_ACTUATOR_ADDEND32_H

/* A 32-bit addend with a sub-second increment: STM32 F4, F7 (PTPTSAR), H7 (MACTSAR), ESP32,
 * DesignWare EQOS, ADIN1110. At each tick of the input clock the addend is added to 32 bits; when
 * they overflow, the time moves on by increment_ns. */

#include <stdint.h>

/* The addend of rate 1, 2^32 10^9 / (input_hz increment_ns), rounded; zero if input_hz increment_ns
 * is not above 10^9 (the increment is too small for this clock). Leave a few percent: F and the
 * oscillator's own error must fit. */
static inline uint32_t ftcs_addend32_nominal(uint32_t input_hz, uint32_t increment_ns) {
  const uint64_t per_second =
      (uint64_t)input_hz * increment_ns; /* ns of time in a second at addend 2^32 */
  const uint64_t second = UINT64_C(1000000000);
  if (per_second <= second || per_second > second << 30) return 0;
  return (uint32_t)(((second << 32) + per_second / 2U) / per_second);
}

/* Registers of one Ethernet MAC; the STM32F4's are PTPTSAR, PTPTSCR, PTPTTHR and PTPTTLR. */
typedef struct ftcs_addend32 {
  volatile uint32_t* addend;
  volatile uint32_t* control;
  volatile uint32_t* target_seconds;
  volatile uint32_t* target_nanoseconds;
  uint32_t update_bit; /* TSARU: take the addend over; the hardware clears it */
  uint32_t alarm_bit;  /* TSITE: interrupt when the clock shows the target time */
} ftcs_addend32;

/* Zero while an earlier addend has not been taken over: try again. */
static inline int ftcs_addend32_write(const ftcs_addend32* mac, uint32_t addend) {
  if ((*mac->control & mac->update_bit) != 0U) return 0;
  *mac->addend = addend;
  *mac->control = *mac->control | mac->update_bit;
  return 1;
}

/* The alarm runs on the steered clock itself, so that T_c needs no other timer. */
static inline void ftcs_addend32_alarm(const ftcs_addend32* mac, int64_t until_ns) {
  *mac->target_seconds = (uint32_t)(until_ns / 1000000000);
  *mac->target_nanoseconds = (uint32_t)(until_ns % 1000000000);
  *mac->control = *mac->control | mac->alarm_bit;
}

#endif
