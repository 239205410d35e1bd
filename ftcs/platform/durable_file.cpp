// SPDX-License-Identifier: MIT
#include "ftcs/platform/durable_file.h"

#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace ftcs::platform {
namespace {

/// errno of the first call that failed, or 0. Closes the file.
int write_and_sync(int file, std::string_view content) {
  int code = 0;
  while (!content.empty() && code == 0) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      code = errno;
    }
  }
  if (code == 0 && ::fsync(file) != 0) code = errno;
  if (::close(file) != 0 && code == 0) code = errno;
  return code;
}

/// rename(2) puts a file in the place of anything: of /dev/null, for one.
bool may_be_replaced(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

void sync_folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)::fsync(descriptor);  // the file is whole either way; only which one may be older
  (void)::close(descriptor);
}

}  // namespace

std::optional<std::string> write_durably(const std::string& path, std::string_view content) {
  const auto failure = [&path](int code) {
    return "cannot write " + path + ": " + std::generic_category().message(code);
  };
  if (!may_be_replaced(path)) return "cannot write " + path + ": it is no regular file";
  std::string part = path + ".XXXXXX";
  const int file = ::mkostemp(part.data(), O_CLOEXEC);
  if (file < 0) return failure(errno);
  int code = write_and_sync(file, content);
  if (code == 0 && ::rename(part.c_str(), path.c_str()) != 0) code = errno;
  if (code != 0) {
    (void)::unlink(part.c_str());
    return failure(code);
  }
  sync_folder_of(path);
  return std::nullopt;
}

}  // namespace ftcs::platform
