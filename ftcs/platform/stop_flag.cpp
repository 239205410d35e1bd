// SPDX-License-Identifier: MIT
#include "ftcs/platform/stop_flag.h"

namespace ftcs::platform {
namespace {

// The one global of this layer: a signal handler has no other way to say anything.
volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) { stop_requested = 1; }

}  // namespace

StopFlag::StopFlag() {
  stop_requested = 0;
  struct sigaction action {};
  action.sa_handler = request_stop;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &previous_interrupt_);
  sigaction(SIGTERM, &action, &previous_terminate_);
}

StopFlag::~StopFlag() {
  sigaction(SIGINT, &previous_interrupt_, nullptr);
  sigaction(SIGTERM, &previous_terminate_, nullptr);
}

bool StopFlag::is_set() const noexcept { return stop_requested != 0; }

}  // namespace ftcs::platform
