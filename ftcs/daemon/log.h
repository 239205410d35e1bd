// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/line_writer.h"

namespace ftcs::daemon {

/// syslog's numbers, as ptp4l's -l takes them.
enum class LogLevel : std::uint8_t { kError = 3, kWarning = 4, kNotice = 5, kInfo = 6, kDebug = 7 };

/// Lines as parsers of ptp4l's log know them: "ftcs[seconds.milliseconds]: text", seconds of
/// CLOCK_MONOTONIC. Errors go to standard error. Nobody waits for a reader (platform::LineWriter);
/// what a flood of messages brings about, notices and warnings, is told kMostASecond times a second
/// of each kind. How many lines were lost or left out is a line of its own.
class Log {
 public:
  static constexpr int kMostASecond = 10;
  /// Of all kinds together, after as many as a start has.
  static constexpr int kMostAtOnce = 40;
  static constexpr int kAllASecond = 5;

  Log(platform::Kernel& kernel, std::FILE* stream, int level);

  template <class... Arguments>
  void operator()(LogLevel level, fmt::format_string<Arguments...> format,
                  Arguments&&... arguments) {
    if (static_cast<int>(level) > level_) return;
    if (!admits(level, fmt::string_view(format).data())) return;
    write(level, fmt::format(format, std::forward<Arguments>(arguments)...));
  }
  /// Who tells it the time.
  [[nodiscard]] platform::Kernel& kernel() const noexcept { return kernel_; }
  /// Once per turn of a loop: writes what a reader was not ready for.
  void flush();

 private:
  struct Kind {
    std::int64_t second = -1;
    int told = 0;
    std::uint64_t left_out = 0;
  };
  /// `kind`: the place of its format string.
  [[nodiscard]] bool admits(LogLevel level, const char* kind);
  [[nodiscard]] bool has_room(std::int64_t now_ns);
  void write(LogLevel level, std::string_view text);

  platform::Kernel& kernel_;
  platform::LineWriter lines_;
  platform::LineWriter errors_;
  int level_;
  std::map<const char*, Kind> kinds_{};
  double room_ = kMostAtOnce;  ///< for lines of all kinds
  std::int64_t room_at_ns_ = 0;
  std::uint64_t left_out_ = 0;
  std::uint64_t lost_ = 0;
  bool failed_ = false;  ///< the stream could not be written, which has been said
};

}  // namespace ftcs::daemon
