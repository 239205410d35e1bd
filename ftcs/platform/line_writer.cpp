// SPDX-License-Identifier: MIT
#include "ftcs/platform/line_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include <climits>

namespace ftcs::platform {
namespace {

// A regular file is not asked: it is always ready, and a simulator that stands in for poll()
// (clknetsim) knows nothing of it.
bool is_ready(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode)) return true;
  pollfd entry{descriptor, POLLOUT, 0};
  return ::poll(&entry, 1, 0) > 0;  // an error too: the write will tell
}

}  // namespace

void LineWriter::write(std::string_view line) {
  if (kept_.size() + line.size() > kMostKept) flush();
  if (kept_.size() + line.size() > kMostKept) {
    ++lost_;
    return;
  }
  kept_ += line;
  flush();
}

// A pipe that is ready takes PIPE_BUF octets without waiting.
void LineWriter::flush() {
  if (kept_.empty()) return;
  const int descriptor = ::fileno(stream_);
  std::size_t done = 0;
  while (done < kept_.size() && is_ready(descriptor)) {
    const std::size_t size = std::min<std::size_t>(kept_.size() - done, PIPE_BUF);
    const ssize_t written = ::write(descriptor, kept_.data() + done, size);
    if (written >= 0) {
      done += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN) {
      break;
    } else if (errno != EINTR) {
      error_ = errno;
      done = kept_.size();
    }
  }
  kept_.erase(0, done);
}

std::uint64_t LineWriter::take_lost() { return std::exchange(lost_, 0); }

const char* write_failure(int number) noexcept {
  return number == EPIPE ? "nobody reads it any more" : std::strerror(number);
}

std::size_t terminal_columns() noexcept {
  constexpr std::size_t kUsual = 80;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kUsual;
  return size.ws_col;
}

}  // namespace ftcs::platform
