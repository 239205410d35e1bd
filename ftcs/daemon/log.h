// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "ftcs/platform/kernel.h"

namespace ftcs::daemon {

/// syslog's numbers, as ptp4l's -l takes them.
enum class LogLevel : std::uint8_t { kError = 3, kWarning = 4, kNotice = 5, kInfo = 6, kDebug = 7 };

/// Lines as parsers of ptp4l's log know them: "ftcs[seconds.milliseconds]: text", seconds of
/// CLOCK_MONOTONIC. Errors go to standard error.
class Log {
 public:
  Log(platform::Kernel& kernel, std::FILE* stream, int level)
      : kernel_(kernel), stream_(stream), level_(level) {}

  template <class... Arguments>
  void operator()(LogLevel level, fmt::format_string<Arguments...> format,
                  Arguments&&... arguments) {
    if (static_cast<int>(level) > level_) return;
    write(level, fmt::format(format, std::forward<Arguments>(arguments)...));
  }

 private:
  void write(LogLevel level, std::string_view text);

  platform::Kernel& kernel_;
  std::FILE* stream_;
  int level_;
};

}  // namespace ftcs::daemon
