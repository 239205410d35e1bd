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

typedef struct {
  uint64_t instructions;
  uint32_t commands;
  uint32_t most;
} tally;

static void take(ftcs_addend_servo* servo, const ftcs_addend_sample* sample,
                 ftcs_addend_command* command, tally* counted) {
  uint32_t count;
  board_count_start();
  ftcs_addend_take(servo, sample, command);
  count = board_count();
  if (command->act != 0) {
    counted->instructions += count;
    ++counted->commands;
    if (count > counted->most) counted->most = count;
  }
  add((uint64_t)(uint32_t)command->verdict << 32 | (uint32_t)command->state);
  add((uint64_t)command->addend << 32 | command->next_addend);
  add((uint64_t)command->until_ns);
  add((uint64_t)command->offset_ns + command->deviation_ns);
}

static void tell(const char* name, uint32_t samples, const tally* counted) {
  board_text(name);
  board_text(" samples ");
  board_decimal(samples);
  board_text(" hash ");
  board_hex(hash);
  board_end_line();
  if (counted->instructions != 0U) {
    board_text("# instructions of an update, ");
    board_text(name);
    board_text(": mean ");
    board_decimal((int64_t)(counted->instructions / counted->commands));
    board_text(" most ");
    board_decimal(counted->most);
    board_end_line();
  }
}

static void run(const char* name, const ftcs_addend_config* config, uint32_t samples) {
  ftcs_addend_servo servo;
  ftcs_addend_sample sample = {
      INT64_C(1700000000000000000), INT64_C(1700000000000300000), 0, 0, 0, 0};
  int64_t interval = 125000000;
  tally counted = {0, 0, 0};
  uint32_t n;
  if (ftcs_addend_init(&servo, config, NOMINAL) != FTCS_ADDEND_OK)
    board_write("configuration refused\n");
  for (n = 0; n < samples; ++n) {
    ftcs_addend_command command;
    next(&sample, &interval);
    take(&servo, &sample, &command, &counted);
    if (random_bits() % 16U == 0U && command.act != 0) {
      ftcs_addend_wrote(&servo, sample.now_ns + 50000, command.addend - command.addend % 100U,
                        command.next_addend);
    }
    add((uint64_t)ftcs_addend_elapsed(&servo, sample.now_ns + 1000));
  }
  tell(name, samples, &counted);
}

/* A clock that obeys. */
typedef struct {
  int64_t shows;
  uint32_t addend;
  uint32_t next_addend;
  int64_t until;
} clock_model;

static int64_t gone(int64_t oscillator_ns, uint32_t addend) {
  return oscillator_ns + oscillator_ns * ((int64_t)addend - (int64_t)NOMINAL) / NOMINAL;
}

static void wait(clock_model* clock, int64_t oscillator_ns) {
  const int64_t first =
      clock->until > clock->shows ? (clock->until - clock->shows) * NOMINAL / clock->addend : 0;
  if (first < oscillator_ns) {
    if (clock->until > clock->shows) clock->shows = clock->until;
    clock->addend = clock->next_addend;
    oscillator_ns -= first;
  }
  clock->shows += gone(oscillator_ns, clock->addend);
}

/* What a user has: 50 ppm, 125 ms, 60 ns of noise, written within 0.9 ms. */
static void run_followed(const char* name, const ftcs_addend_config* config, uint32_t samples) {
  ftcs_addend_servo servo;
  ftcs_addend_sample sample = {INT64_C(1700000000000000000), 0, 0, 0, 0, 0};
  clock_model clock = {INT64_C(1700000000001000000), NOMINAL, NOMINAL, 0};
  tally counted = {0, 0, 0};
  uint32_t n;
  (void)ftcs_addend_init(&servo, config, NOMINAL);
  for (n = 0; n < samples; ++n) {
    const int64_t latency = (int64_t)(random_bits() % 900000U);
    ftcs_addend_command command;
    sample.local_ns = clock.shows + (int64_t)(random_bits() % 121U) - 60;
    wait(&clock, latency);
    sample.now_ns = clock.shows;
    take(&servo, &sample, &command, &counted);
    if (command.act != 0) {
      clock.addend = command.addend;
      clock.next_addend = command.next_addend;
      clock.until = command.until_ns;
    }
    wait(&clock, 125006250 - latency);
    sample.origin_ns += 125000000;
  }
  add((uint64_t)clock.shows);
  tell(name, samples, &counted);
}

int main(void) {
  ftcs_addend_config config = ftcs_addend_default_config(NOMINAL);
  run("jumps", &config, SAMPLES);
  run_followed("ftcs", &config, SAMPLES / 10);
  config.band_enter_ns = 300;
  config.band_leave_ns = 1000;
  config.correction_ns = 900000;
  config.dwell = 2;
  run("jumps, band", &config, SAMPLES / 10);
  run_followed("ftcs, band", &config, SAMPLES / 10);
#if !defined(FTCS_ADDEND_BARE)
  config = ftcs_addend_quiet_config(NOMINAL);
  run("jumps, quiet mode", &config, SAMPLES / 10);
  run_followed("quiet mode", &config, SAMPLES / 10);
#endif
  return 0;
}
