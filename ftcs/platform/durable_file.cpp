// SPDX-License-Identifier: MIT
#include "ftcs/platform/durable_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {
namespace {

/// errno of the first call that failed, or 0.
int write_and_sync(int file, std::string_view content, Readers readers) {
  constexpr mode_t kReadable = 0644;
  int code = 0;
  if (readers == Readers::kEverybody && ::fchmod(file, kReadable) != 0) code = errno;
  while (!content.empty() && code == 0) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      code = errno;
    }
  }
  if (code == 0 && ::fsync(file) != 0) code = errno;
  return code;
}

/// rename(2) puts a file in the place of anything: of /dev/null, for one.
bool may_be_replaced(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

/// Closes it. `code`, or errno.
int close_after(int file, int code) { return ::close(file) != 0 && code == 0 ? errno : code; }

/// Gives a file without a name one, for the moment until it is renamed. errno, or 0.
int name_part(int file, const std::string& path, std::string& part) {
  const std::string self = "/proc/self/fd/" + std::to_string(file);
  std::string name = path + "." + std::to_string(::getpid());
  if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) != 0) {
    return errno;
  }
  part = std::move(name);
  return 0;
}

/// Into a file without a name: a process that is killed while it writes leaves nothing behind.
/// errno, or 0; `part` is the name that it has at the end. Not every file system has such files,
/// and naming one needs /proc.
int write_unnamed(const std::string& path, std::string_view content, Readers readers,
                  std::string& part) {
  const int file = ::open(folder_of(path).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (file < 0) return errno;
  int code = write_and_sync(file, content, readers);
  if (code == 0) code = name_part(file, path, part);
  // Once more: btrfs synchronises nothing of a file that has no name.
  if (code == 0 && ::fsync(file) != 0) code = errno;
  return close_after(file, code);
}

int write_named(const std::string& path, std::string_view content, Readers readers,
                std::string& part) {
  std::string name = path + ".XXXXXX";
  const int file = ::mkostemp(name.data(), O_CLOEXEC);
  if (file < 0) return errno;
  part = std::move(name);
  return close_after(file, write_and_sync(file, content, readers));
}

void sync_folder_of(const std::string& path) {
  const std::string folder = folder_of(path);
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)::fsync(descriptor);  // the file is whole either way; only which one may be older
  (void)::close(descriptor);
}

}  // namespace

std::optional<std::string> write_durably(const std::string& path, std::string_view content,
                                         Readers readers) {
  const auto failure = [&path](int code) {
    return "cannot write " + path + ": " + std::generic_category().message(code);
  };
  if (!may_be_replaced(path)) return "cannot write " + path + ": it is no regular file";
  std::string part;
  int code = write_unnamed(path, content, readers, part);
  if (code != 0 && part.empty()) code = write_named(path, content, readers, part);
  if (code == 0 && ::rename(part.c_str(), path.c_str()) != 0) code = errno;
  if (code != 0) {
    if (!part.empty()) (void)::unlink(part.c_str());
    return failure(code);
  }
  sync_folder_of(path);
  return std::nullopt;
}

bool cut_to_nothing(std::FILE* file) {
  const int descriptor = ::fileno(file);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return false;
  return !S_ISREG(status.st_mode) || ::ftruncate(descriptor, 0) == 0;
}

Result<std::vector<char>, int> read_regular(const std::string& path, std::size_t largest) {
  // Without O_NONBLOCK a pipe would be waited for until somebody writes to it.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return errno;
  std::vector<char> content;
  struct stat status {};
  int code = ::fstat(descriptor, &status) != 0 ? errno : 0;
  if (code == 0 && !S_ISREG(status.st_mode)) code = EINVAL;
  ssize_t got = 1;
  while (code == 0 && got > 0) {
    std::array<char, 4096> piece{};
    got = ::read(descriptor, piece.data(), piece.size());
    if (got < 0) code = errno;
    content.insert(content.end(), piece.begin(), piece.begin() + std::max<ssize_t>(got, 0));
    if (content.size() > largest) code = EFBIG;
  }
  ::close(descriptor);
  if (code != 0) return code;
  return content;
}

}  // namespace ftcs::platform
