// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <csignal>

namespace ftcs::platform {

/// Turns SIGINT, SIGTERM, SIGHUP and SIGQUIT into a flag for as long as it lives; one at a time. A
/// signal also ends a poll(2). SIGPIPE is ignored meanwhile: a reader of our output that goes away
/// must not end the program before it has left its clock at a good rate.
class StopFlag {
 public:
  StopFlag();
  ~StopFlag();
  StopFlag(const StopFlag&) = delete;
  StopFlag& operator=(const StopFlag&) = delete;

  [[nodiscard]] bool is_set() const noexcept;

 private:
  static constexpr std::array<int, 5> kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE};

  std::array<struct sigaction, kSignals.size()> previous_{};
};

/// Turns SIGHUP into a wish for as long as it lives, within a StopFlag, which would take it for an
/// end.
class HangupFlag {
 public:
  HangupFlag();
  ~HangupFlag();
  HangupFlag(const HangupFlag&) = delete;
  HangupFlag& operator=(const HangupFlag&) = delete;

  /// Whether a signal has come since it was asked last.
  [[nodiscard]] bool take() noexcept;

 private:
  struct sigaction previous_ {};
};

}  // namespace ftcs::platform
