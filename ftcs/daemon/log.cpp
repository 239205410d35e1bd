// SPDX-License-Identifier: MIT
#include "ftcs/daemon/log.h"

#include <ctime>
#include <string>

namespace ftcs::daemon {

void Log::write(LogLevel level, std::string_view text) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  const std::int64_t ms = kernel_.clock_ns(CLOCK_MONOTONIC) / kNsPerMs;
  std::FILE* const stream = level <= LogLevel::kError ? stderr : stream_;
  const std::string line = fmt::format("ftcs[{}.{:03}]: {}\n", ms / 1000, ms % 1000, text);
  std::fputs(line.c_str(), stream);  // a log on a full disk is no reason to stop steering
  std::fflush(stream);               // whoever follows a pipe wants each line at once
}

}  // namespace ftcs::daemon
