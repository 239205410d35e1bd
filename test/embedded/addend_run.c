/* SPDX-License-Identifier: MIT */
/* The same random samples on every machine: the hash of all commands, and what an update costs
 * where it can be counted. */
#include "board.h"
#include "ftcs_addend.h"

#ifndef SAMPLES
#define SAMPLES 100000
#endif
#define NOMINAL 0x4C30C30CU

static uint64_t state = UINT64_C(88172645463325252);

static uint32_t random_bits(void) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (uint32_t)(state >> 16);
}

static uint64_t hash = UINT64_C(0xcbf29ce484222325);

static void add(uint64_t value) {
  hash = (hash ^ value) * UINT64_C(0x100000001b3);
  hash ^= hash >> 29;
}

/* Intervals of 1 ms to 16 s, jumps, repeated and lost messages, late writes: nothing is followed,
 * everything is decided. */
static void next(ftcs_addend_sample* sample, int64_t* interval) {
  const uint32_t kind = random_bits() % 256U;
  const int64_t gap = kind == 0U ? 0 : (kind < 4U ? 3 * *interval : *interval);
  if (kind == 5U) *interval = INT64_C(1000000) << (random_bits() % 14U);
  if (kind == 6U) sample->origin_ns += (int64_t)random_bits() - INT64_C(0x80000000);
  sample->origin_ns += gap;
  sample->local_ns += gap + gap / 20000 + (int64_t)(random_bits() % 201U) - 100;
  sample->origin_fraction = (uint16_t)random_bits();
  sample->local_fraction = (uint16_t)random_bits();
  sample->now_ns = sample->local_ns + (int64_t)(random_bits() % 900000U);
  sample->path_delay_scaled = 32768000 + (int64_t)(random_bits() % 65536U);
}

static void run(const char* name, const ftcs_addend_config* config, uint32_t samples) {
  ftcs_addend_servo servo;
  ftcs_addend_sample sample = {
      INT64_C(1700000000000000000), INT64_C(1700000000000300000), 0, 0, 0, 0};
  int64_t interval = 125000000;
  uint64_t counted = 0;
  uint32_t used = 0;
  uint32_t most = 0;
  uint32_t n;
  if (ftcs_addend_init(&servo, config, NOMINAL) != FTCS_ADDEND_OK)
    board_write("configuration refused\n");
  for (n = 0; n < samples; ++n) {
    ftcs_addend_command command;
    uint32_t count;
    next(&sample, &interval);
    board_count_start();
    command = ftcs_addend_update(&servo, &sample);
    count = board_count();
    if (command.act != 0) {
      counted += count;
      ++used;
      if (count > most) most = count;
    }
    add((uint64_t)(uint32_t)command.verdict << 32 | (uint32_t)command.state);
    add((uint64_t)command.addend << 32 | command.next_addend);
    add((uint64_t)command.until_ns);
    add((uint64_t)command.offset_ns + command.deviation_ns);
    if (random_bits() % 16U == 0U && command.act != 0) {
      ftcs_addend_wrote(&servo, sample.now_ns + 50000, command.addend - command.addend % 100U,
                        command.next_addend);
    }
    add((uint64_t)ftcs_addend_elapsed(&servo, sample.now_ns + 1000));
  }
  board_text(name);
  board_text(" samples ");
  board_decimal(samples);
  board_text(" hash ");
  board_hex(hash);
  board_end_line();
  if (counted != 0U) {
    board_text("# instructions of an update, ");
    board_text(name);
    board_text(": mean ");
    board_decimal((int64_t)(counted / used));
    board_text(" most ");
    board_decimal(most);
    board_end_line();
  }
}

int main(void) {
  ftcs_addend_config config = ftcs_addend_default_config(NOMINAL);
  run("ftcs", &config, SAMPLES);
  config.band_enter_ns = 300;
  config.band_leave_ns = 1000;
  config.correction_ns = 900000;
  config.dwell = 2;
  run("band", &config, SAMPLES / 10);
#ifndef FTCS_ADDEND_WITHOUT_QUIET
  config = ftcs_addend_default_config(NOMINAL);
  config.quiet_memory = 64;
  run("quiet", &config, SAMPLES / 10);
#endif
  return 0;
}
