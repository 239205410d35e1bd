/* SPDX-License-Identifier: MIT */
#ifndef FTCS_TEST_LAN9118_H
#define FTCS_TEST_LAN9118_H

/* SMSC LAN9118 at its place on Arm's MPS2 boards: frames in and out by registers (datasheet,
 * chapters 3 and 5). */

#include <stddef.h>
#include <stdint.h>

#define LAN9118 ((volatile uint32_t*)0x40200000U)

enum {
  LAN_RX_DATA = 0x00 / 4,
  LAN_TX_DATA = 0x20 / 4,
  LAN_RX_STATUS = 0x40 / 4,
  LAN_IRQ_CFG = 0x54 / 4,
  LAN_INT_STS = 0x58 / 4,
  LAN_INT_EN = 0x5C / 4,
  LAN_FIFO_INT = 0x68 / 4,
  LAN_TX_CFG = 0x70 / 4,
  LAN_HW_CFG = 0x74 / 4,
  LAN_RX_FIFO_INF = 0x7C / 4,
  LAN_MAC_COMMAND = 0xA4 / 4,
  LAN_MAC_DATA = 0xA8 / 4
};

#define LAN_FRAME_CAME (1U << 3) /* status FIFO above the level in LAN_FIFO_INT: above zero */

/* With an interrupt for each frame that comes. */
static inline void lan9118_start(void) {
  const uint32_t busy = 1U << 31;
  LAN9118[LAN_HW_CFG] = 0x00050000U;
  LAN9118[LAN_TX_CFG] = 2U; /* on */
  LAN9118[LAN_FIFO_INT] = 0U;
  LAN9118[LAN_INT_EN] = LAN_FRAME_CAME;
  LAN9118[LAN_IRQ_CFG] = (1U << 8) | (1U << 4) | 1U; /* on, active high, push-pull */
  LAN9118[LAN_MAC_DATA] =
      (1U << 18) | (1U << 19) | (1U << 3) | (1U << 2); /* all frames, transmit, receive */
  LAN9118[LAN_MAC_COMMAND] = busy | 1U;                /* write MAC_CR */
  while ((LAN9118[LAN_MAC_COMMAND] & busy) != 0U) {
  }
}

/* Returns the frame's last word, with which lan9118_go() sends it. */
static inline uint32_t lan9118_load(const uint8_t* frame, size_t size) {
  size_t i;
  LAN9118[LAN_TX_DATA] = (1U << 13) | (1U << 12) | (uint32_t)size; /* first and last segment */
  LAN9118[LAN_TX_DATA] = (uint32_t)size;
  for (i = 0;; i += 4) {
    uint32_t word = 0;
    size_t k;
    for (k = 0; k < 4 && i + k < size; ++k) word |= (uint32_t)frame[i + k] << (8 * k);
    if (i + 4 >= size) return word;
    LAN9118[LAN_TX_DATA] = word;
  }
}

static inline void lan9118_go(uint32_t last_word) { LAN9118[LAN_TX_DATA] = last_word; }

static inline void lan9118_acknowledge(void) { LAN9118[LAN_INT_STS] = LAN_FRAME_CAME; }

static inline uint32_t lan9118_frames(void) { return (LAN9118[LAN_RX_FIFO_INF] >> 16) & 0xFFU; }

/* The size of the frame, without its check sequence; zero: there is none. */
static inline size_t lan9118_receive(uint8_t* frame, size_t room) {
  uint32_t length;
  size_t i;
  if (lan9118_frames() == 0U) return 0;
  length = (LAN9118[LAN_RX_STATUS] >> 16) & 0x3FFFU;
  for (i = 0; i < length; i += 4) {
    const uint32_t word = LAN9118[LAN_RX_DATA];
    size_t k;
    for (k = 0; k < 4; ++k) {
      if (i + k < room) frame[i + k] = (uint8_t)(word >> (8 * k));
    }
  }
  return length > 4U && length <= room ? length - 4U : 0;
}

#endif
