/* SPDX-License-Identifier: MIT */
#pragma once
#include <stdint.h>
typedef struct {
  int64_t ticks;
} k_timeout_t;
struct k_work {
  int flags;
};
struct k_work_delayable {
  struct k_work work;
  void (*handler)(struct k_work*);
};
struct k_mutex {
  int owner;
};
#define K_WORK_DELAYABLE_DEFINE(name, function) struct k_work_delayable name = {{0}, function}
#define K_MUTEX_DEFINE(name) struct k_mutex name = {0}
#define K_NSEC(t) ((k_timeout_t){(t)})
#define K_FOREVER ((k_timeout_t){-1})
int k_mutex_lock(struct k_mutex* mutex, k_timeout_t timeout);
int k_mutex_unlock(struct k_mutex* mutex);
int k_work_schedule(struct k_work_delayable* work, k_timeout_t delay);
int k_work_cancel_delayable(struct k_work_delayable* work);
