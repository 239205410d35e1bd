// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <future>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/log.h"
#include "ftcs/servo/learnt_state.h"
#include "ftcs/servo/servo.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// What `--driftfile` holds: JSON, one object.
struct KeptState {
  std::string clock;            ///< which oscillator it was: interface, kind of timestamps, skew
  std::int64_t saved_at_s = 0;  ///< CLOCK_REALTIME, seconds since 1970
  LearntState learnt{};
};

[[nodiscard]] std::string to_text(const KeptState& state);
/// The state in `text`, fit for `clock` at `now_s`; or why it cannot be used.
[[nodiscard]] Result<LearntState, std::string> read_kept_state(std::string_view text,
                                                               std::string_view clock,
                                                               std::int64_t now_s);

/// Keeps what a servo has learnt in a file: read once at the start, written every `interval` while
/// the clock is locked, and at the end. Whatever is wrong with the file is a warning; the run goes
/// on without it.
class StateKeeper {
 public:
  /// An empty path: keeps nothing.
  StateKeeper(Log& log, std::string path, Duration interval, std::string clock);

  [[nodiscard]] const std::optional<LearntState>& learnt() const { return learnt_; }
  /// After each sample of a locked clock. The file is written beside the loop, by a thread: what
  /// steers does not wait for a disk.
  void note(const ServoSnapshot& snapshot, FreeRunningTime now);
  /// At the end.
  void save();

 private:
  /// False: the last writing is not done yet. `wait`: until it is.
  [[nodiscard]] bool take_result(bool wait);
  void report(const std::optional<std::string>& problem);

  Log& log_;
  std::string path_;
  Duration interval_;
  std::string clock_;
  std::optional<LearntState> learnt_;  ///< from the file
  std::optional<LearntState> latest_;
  std::optional<FreeRunningTime> saved_;
  std::future<std::optional<std::string>> writing_{};
  bool warned_ = false;
};

}  // namespace ftcs::daemon
