/* SPDX-License-Identifier: MIT */
#include "board.h"

static char line[256];
static unsigned length;

static void put(char c) {
  if (length < sizeof line - 2U) line[length++] = c;
}

void board_text(const char* text) {
  while (*text != '\0') put(*text++);
}

void board_decimal(int64_t value) {
  char digits[20];
  int count = 0;
  uint64_t rest = value < 0 ? 0U - (uint64_t)value : (uint64_t)value;
  if (value < 0) put('-');
  do {
    digits[count++] = (char)('0' + (char)(rest % 10U));
    rest /= 10U;
  } while (rest != 0U);
  while (count > 0) put(digits[--count]);
}

void board_hex(uint64_t value) {
  int shift;
  for (shift = 60; shift >= 0; shift -= 4) put("0123456789abcdef"[(value >> shift) & 15U]);
}

void board_end_line(void) {
  line[length] = '\n';
  line[length + 1U] = '\0';
  length = 0;
  board_write(line);
}
