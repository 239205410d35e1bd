/* SPDX-License-Identifier: MIT */
/* Vector table, start, semihosting (Arm's "Semihosting for AArch32 and AArch64", 2.0) and a count
 * of instructions for a Cortex-M in QEMU. */
#include <stddef.h>

#include "board.h"

extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;
typedef void (*function)(void);
extern const function init_array_start[], init_array_end[];

int main(void);
static void calibrate(void);
void reset(void);

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026 };

static void semihost(uint32_t operation, const void* argument) {
  register uint32_t r0 __asm("r0") = operation;
  register const void* r1 __asm("r1") = argument;
  __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void board_write(const char* text) { semihost(SYS_WRITE0, text); }

static void leave(uint32_t code) {
  const uint32_t block[2] = {APPLICATION_EXIT, code};
  semihost(SYS_EXIT_EXTENDED, block);
  for (;;) {
  }
}

static void fault(void) {
  board_write("fault\n");
  leave(3);
}

void reset(void) {
  uint32_t* to;
  const uint32_t* from = &data_load;
  const function* constructor;
#if defined(__ARM_FP)
  *(volatile uint32_t*)0xE000ED88U |= 0xFU << 20; /* CPACR: the floating point unit may be used */
  __asm volatile("dsb\n isb");
#endif
  for (to = &data_start; to < &data_end; ++to) *to = *from++;
  for (to = &bss_start; to < &bss_end; ++to) *to = 0;
  for (constructor = init_array_start; constructor < init_array_end; ++constructor)
    (*constructor)();
  calibrate();
  leave((uint32_t)main());
}

static void nothing(void) {}

__attribute__((section(".vectors"), used)) static const void* const vectors[16 + 14] = {
    [0] = &stack_top,
    [1] = (const void*)reset,
    [2] = (const void*)fault,
    [3] = (const void*)fault,
    [4] = (const void*)fault,
    [5] = (const void*)fault,
    [6] = (const void*)fault,
    [15] = (const void*)nothing, /* SysTick: it ends a WFI */
    [16 + 13] = (const void*)board_ethernet_interrupt};

/* With QEMU's -icount shift=8 an instruction takes 256 ns of the machine's time, and SysTick counts
 * its 25 MHz: 6.4 ticks an instruction. What counting nothing costs is subtracted. */
#define SYSTICK ((volatile uint32_t*)0xE000E010U)

static uint32_t began;
static uint32_t overhead;

static uint32_t ticks(void) { return 0xFFFFFFU - SYSTICK[2]; }

void board_count_start(void) {
  SYSTICK[1] = 0xFFFFFFU;
  SYSTICK[0] = 5;
  began = ticks();
}

static __attribute__((noinline)) uint32_t elapsed(void) { return (ticks() - began) & 0xFFFFFFU; }

static void calibrate(void) {
  board_count_start();
  overhead = elapsed();
}

uint32_t board_count(void) {
  const uint32_t counted = elapsed();
  return counted < overhead ? 0U : (counted - overhead) * 5U / 32U;
}
