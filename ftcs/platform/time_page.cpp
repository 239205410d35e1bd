// SPDX-License-Identifier: MIT
#include "ftcs/platform/time_page.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr std::size_t kSize = 4096;
/// A writer that says nothing for so long is gone: it writes once a second at least.
constexpr std::int64_t kFreshNs = 3'000'000'000;

/// 0, errno, or EEXIST: what is there is somebody else's.
int check_content(int file, off_t size) {
  if (size == 0) return 0;
  if (size != static_cast<off_t>(kSize)) return EEXIST;
  std::array<char, kSize> content{};
  const ssize_t count = ::pread(file, content.data(), kSize, 0);
  if (count < 0) return errno;
  std::uint32_t magic = 0;
  std::memcpy(&magic, content.data(), sizeof magic);
  const bool zeros = std::all_of(content.begin(), content.end(), [](char c) { return c == 0; });
  return magic == FTCS_TIME_PAGE_MAGIC || zeros ? 0 : EEXIST;
}

/// 0 or errno.
int make_page(int file) {
  struct stat status {};
  if (::fstat(file, &status) != 0) return errno;
  if (!S_ISREG(status.st_mode)) return EINVAL;
  if (const int code = check_content(file, status.st_size); code != 0) return code;
  constexpr mode_t kReadable = 0644;
  if (::fchmod(file, kReadable) != 0 || ::ftruncate(file, kSize) != 0) return errno;
  return 0;
}

}  // namespace

Result<TimePage, OsError> TimePage::open(const std::string& path) {
  constexpr mode_t kReadable = 0644;
  const auto failed = [&path](int code) {
    OsError error = os_error(code, "time page " + path);
    if (code == EEXIST) error.kind = OsErrorKind::kForeignFile;
    return error;
  };
  const int file =
      ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, kReadable);
  if (file < 0) return failed(errno);
  int code = ::flock(file, LOCK_EX | LOCK_NB) == 0 ? make_page(file) : errno;
  void* memory = MAP_FAILED;
  if (code == 0) {
    memory = ::mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) code = errno;
  }
  if (code != 0) {
    ::close(file);
    return failed(code == EWOULDBLOCK ? EBUSY : code);
  }
  TimePage page(static_cast<ftcs_time_page*>(memory), file);
  page.page_->sequence = 0;
  page.write({});
  page.page_->version = FTCS_TIME_PAGE_VERSION;
  page.page_->fresh_ns = kFreshNs;
  __atomic_store_n(&page.page_->magic, FTCS_TIME_PAGE_MAGIC, __ATOMIC_RELEASE);
  return page;
}

TimePage::TimePage(TimePage&& other) noexcept
    : page_(std::exchange(other.page_, nullptr)), file_(std::exchange(other.file_, -1)) {}

TimePage::~TimePage() {
  if (page_ == nullptr) return;
  write({});
  ::munmap(page_, kSize);
  ::close(file_);
}

void TimePage::write(const Content& content) noexcept {
  const std::uint32_t before = page_->sequence;
  __atomic_store_n(&page_->sequence, before + 1, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_RELEASE);
  page_->state = content.state;
  page_->raw_ns = content.raw_ns;
  page_->time_ns = content.time_ns;
  page_->rate = content.rate;
  page_->bound_ns = content.bound_ns;
  page_->growth = content.growth;
  __atomic_store_n(&page_->sequence, before + 2, __ATOMIC_RELEASE);
}

}  // namespace ftcs::platform
