// SPDX-License-Identifier: MIT
#include "ftcs/platform/stop_flag.h"

#include <cstddef>

namespace ftcs::platform {
namespace {

// The globals of this layer: a signal handler has no other way to say anything.
volatile std::sig_atomic_t stop_requested = 0;
volatile std::sig_atomic_t hung_up = 0;

void request_stop(int) { stop_requested = 1; }
void hang_up(int) { hung_up = 1; }

}  // namespace

StopFlag::StopFlag() {
  stop_requested = 0;
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    action.sa_handler = kSignals[i] == SIGPIPE ? SIG_IGN : request_stop;
    sigaction(kSignals[i], &action, &previous_[i]);
  }
}

StopFlag::~StopFlag() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &previous_[i], nullptr);
}

bool StopFlag::is_set() const noexcept { return stop_requested != 0; }

HangupFlag::HangupFlag() {
  hung_up = 0;
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = hang_up;
  sigaction(SIGHUP, &action, &previous_);
}

HangupFlag::~HangupFlag() { sigaction(SIGHUP, &previous_, nullptr); }

bool HangupFlag::take() noexcept {
  const bool came = hung_up != 0;
  hung_up = 0;
  return came;
}

}  // namespace ftcs::platform
