// SPDX-License-Identifier: MIT
/*
 * Loaded into QEMU (LD_PRELOAD): its processor and its main loop run in turns.
 *
 * With -icount sleep=off the main loop lets the time jump to the next timer when the processor
 * sleeps. It looks whether it does in a thread of its own, and may look after HLT has been
 * executed and before the instructions of that stretch have been counted: then the time is late
 * by these, one in the usual case, and the run is another one from there on. That takes a main
 * loop which wakes up by itself (a timer's virtual nanoseconds serve it as a timeout in real ones)
 * and a host that holds one of the two threads up just then.
 *
 * So the main loop returns from its poll only while the processor waits to be woken, and has not
 * been yet: after whatever the last stretch was is counted.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <linux/futex.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static atomic_int processor; /* its thread: the first beside the main loop that waits for a condition */
static _Atomic(pthread_cond_t *) halted; /* which */
static atomic_int is_awake;
static atomic_int main_waits;

static void fall_asleep(void) {
  atomic_store(&is_awake, 0);
  if (atomic_load(&main_waits)) syscall(SYS_futex, &is_awake, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0);
}

int pthread_cond_wait(pthread_cond_t *condition, pthread_mutex_t *mutex) {
  static int (*wait)(pthread_cond_t *, pthread_mutex_t *);
  if (!wait) *(void **)&wait = dlsym(RTLD_NEXT, "pthread_cond_wait");
  const int self = gettid();
  int nobody = 0;
  if (self != getpid()) atomic_compare_exchange_strong(&processor, &nobody, self);
  if (self != atomic_load(&processor)) return wait(condition, mutex);
  atomic_store(&halted, condition);
  fall_asleep();
  const int result = wait(condition, mutex);
  atomic_store(&is_awake, 1);
  return result;
}

int pthread_cond_broadcast(pthread_cond_t *condition) {
  static int (*wake)(pthread_cond_t *);
  if (!wake) *(void **)&wake = dlsym(RTLD_NEXT, "pthread_cond_broadcast");
  if (condition == atomic_load(&halted)) atomic_store(&is_awake, 1);
  return wake(condition);
}

int ppoll(struct pollfd *descriptors, nfds_t count, const struct timespec *timeout, const sigset_t *mask) {
  static int (*wait)(struct pollfd *, nfds_t, const struct timespec *, const sigset_t *);
  if (!wait) *(void **)&wait = dlsym(RTLD_NEXT, "ppoll");
  const int result = wait(descriptors, count, timeout, mask);
  if (gettid() != getpid() || !atomic_load(&is_awake)) return result;
  /* A guest that never sleeps is not to keep QEMU from being ended. */
  const struct timespec longest = {3, 0};
  atomic_store(&main_waits, 1);
  syscall(SYS_futex, &is_awake, FUTEX_WAIT_PRIVATE, 1, &longest, NULL, 0);
  atomic_store(&main_waits, 0);
  return result;
}
