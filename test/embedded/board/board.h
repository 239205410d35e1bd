/* SPDX-License-Identifier: MIT */
#ifndef FTCS_TEST_BOARD_H
#define FTCS_TEST_BOARD_H

/* The little that a test program needs of its machine, on a Cortex-M in QEMU (startup.c) and on the
 * host (host.c). */

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Semihosting on the Cortex-M. */
void board_write(const char* text);
/* Instructions since the last board_count_start(), near enough: exact on average (startup.c); zero
 * on the host. */
void board_count_start(void);
uint32_t board_count(void);

/* Called as the Ethernet adapter asks for it, where a program has it. */
void board_ethernet_interrupt(void) __attribute__((weak));

/* A line of a test's output, put together without stdio. */
void board_text(const char* text);
void board_decimal(int64_t value);
void board_hex(uint64_t value);
void board_end_line(void);

#ifdef __cplusplus
}
#endif

#endif
