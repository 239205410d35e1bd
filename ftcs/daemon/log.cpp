// SPDX-License-Identifier: MIT
#include "ftcs/daemon/log.h"

#include <algorithm>
#include <ctime>
#include <string>
#include <utility>

#include "ftcs/time/duration.h"

namespace ftcs::daemon {

Log::Log(platform::Kernel& kernel, std::FILE* stream, int level)
    : kernel_(kernel), lines_(stream), errors_(stderr), level_(level) {
  std::fflush(stream);  // from here on lines go by it
}

bool Log::admits(LogLevel level, const char* kind) {
  const bool from_outside = level == LogLevel::kWarning || level == LogLevel::kNotice;
  if (!from_outside) return true;  // errors end a run, samples have a rate of their own
  const std::int64_t now_ns = kernel_.clock_ns(CLOCK_MONOTONIC);
  const std::int64_t second = now_ns / kNsPerSecond;
  Kind& known = kinds_[kind];
  if (known.second != second) {
    const std::uint64_t left_out = std::exchange(known.left_out, 0);
    known.second = second;
    known.told = 0;
    if (left_out > 0) write(level, fmt::format("{} lines of the next kind left out", left_out));
  }
  if (++known.told > kMostASecond) {
    ++known.left_out;
    return false;
  }
  return has_room(now_ns);
}

bool Log::has_room(std::int64_t now_ns) {
  const double passed_s = static_cast<double>(now_ns - std::exchange(room_at_ns_, now_ns)) * 1e-9;
  room_ = std::min<double>(kMostAtOnce, room_ + passed_s * kAllASecond);
  if (room_ < 1.0) {
    ++left_out_;
    return false;
  }
  room_ -= 1.0;
  if (const std::uint64_t left_out = std::exchange(left_out_, 0); left_out > 0) {
    room_ -= 1.0;
    write(LogLevel::kWarning, fmt::format("{} lines of several kinds left out", left_out));
  }
  return true;
}

void Log::write(LogLevel level, std::string_view text) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  const std::int64_t ms = kernel_.clock_ns(CLOCK_MONOTONIC) / kNsPerMs;
  const auto line = [ms](std::string_view what) {
    return fmt::format("ftcs[{}.{:03}]: {}\n", ms / 1000, ms % 1000, what);
  };
  if (level <= LogLevel::kError) return errors_.write(line(text));
  lines_.flush();
  lost_ += lines_.take_lost();
  if (lines_.is_empty() && lost_ > 0) {
    lines_.write(line(fmt::format("{} lines lost: nobody read them", std::exchange(lost_, 0))));
  }
  lines_.write(line(text));
  if (lines_.error() != 0 && !std::exchange(failed_, true)) {
    errors_.write(line(fmt::format("standard output: {}; lines are lost, the program goes on",
                                   platform::write_failure(lines_.error()))));
  }
}

void Log::flush() {
  lines_.flush();
  errors_.flush();
}

}  // namespace ftcs::daemon
