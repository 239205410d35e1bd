// SPDX-License-Identifier: MIT
#include "ftcs/platform/kernel.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <sys/un.h>
#include <unistd.h>

#include "ftcs/time/duration.h"

namespace ftcs::platform {
namespace {

template <class Number>
Number or_errno(Number result) noexcept {
  return result < 0 ? static_cast<Number>(-errno) : result;
}

timespec to_timespec(std::int64_t ns) noexcept {
  return {.tv_sec = ns / kNsPerSecond, .tv_nsec = ns % kNsPerSecond};
}

}  // namespace

std::int64_t LinuxKernel::clock_ns(clockid_t clock) noexcept {
  timespec time{};
  if (::clock_gettime(clock, &time) != 0) return 0;
  return std::int64_t{time.tv_sec} * kNsPerSecond + time.tv_nsec;
}

int LinuxKernel::socket(int domain, int type) noexcept {
  return or_errno(::socket(domain, type, 0));
}

int LinuxKernel::bind(int fd, const SocketAddress& address) noexcept {
  return or_errno(::bind(fd, address.get(), address.size()));
}

int LinuxKernel::connect(int fd, const SocketAddress& address) noexcept {
  return or_errno(::connect(fd, address.get(), address.size()));
}

std::uint16_t LinuxKernel::port_of(int fd) noexcept {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return 0;
  return SocketAddress::from(storage).port();
}

int LinuxKernel::set_option(int fd, int level, int name, const void* value,
                            socklen_t size) noexcept {
  return or_errno(::setsockopt(fd, level, name, value, size));
}

int LinuxKernel::set_nonblocking(int fd) noexcept {
  const int flags = or_errno(::fcntl(fd, F_GETFL, 0));
  return flags < 0 ? flags : or_errno(::fcntl(fd, F_SETFL, flags | O_NONBLOCK));
}

ssize_t LinuxKernel::send_to(int fd, std::span<const std::uint8_t> bytes,
                             const SocketAddress& to) noexcept {
  const sockaddr* const where = to.size() > 0 ? to.get() : nullptr;
  return or_errno(::sendto(fd, bytes.data(), bytes.size(), 0, where, to.size()));
}

ssize_t LinuxKernel::receive(int fd, msghdr& message, int flags) noexcept {
  return or_errno(::recvmsg(fd, &message, flags));
}

int LinuxKernel::control(int fd, unsigned long request, void* argument) noexcept {
  return or_errno(::ioctl(fd, request, argument));
}

int LinuxKernel::open(const char* path, int flags) noexcept {
  constexpr mode_t kOwner = 0600;  // of what O_CREAT makes
  return or_errno(::open(path, flags, kOwner));
}

int LinuxKernel::poll(std::span<pollfd> descriptors, int timeout_ms) noexcept {
  return or_errno(::poll(descriptors.data(), descriptors.size(), timeout_ms));
}

int LinuxKernel::wait_readable(int fd, std::int64_t timeout_ns) noexcept {
  const timespec timeout = to_timespec(std::max<std::int64_t>(timeout_ns, 0));
  pollfd entry{.fd = fd, .events = POLLIN, .revents = 0};
  return or_errno(::ppoll(&entry, 1, &timeout, nullptr));
}

void LinuxKernel::sleep_until(std::int64_t instant_ns) noexcept {
  const timespec instant = to_timespec(instant_ns);
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &instant, nullptr);
}

void LinuxKernel::close(int fd) noexcept { ::close(fd); }

ssize_t LinuxKernel::read(int fd, std::span<std::uint8_t> bytes) noexcept {
  return or_errno(::read(fd, bytes.data(), bytes.size()));
}

int LinuxKernel::adjust_clock(clockid_t clock, timex& request) noexcept {
  return or_errno(::clock_adjtime(clock, &request));
}

int LinuxKernel::open_timer() noexcept {
  return or_errno(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK));
}

int LinuxKernel::set_timer(int fd, std::int64_t from_now_ns) noexcept {
  itimerspec when{};
  when.it_value = to_timespec(std::max<std::int64_t>(from_now_ns, 1));  // zero would disarm it
  return or_errno(::timerfd_settime(fd, 0, &when, nullptr));
}

namespace {

/// Whether who listens there is root, a system account, as services have, or of our own user:
/// anybody may take a name that is public.
bool is_held_by_ours(int fd, const sockaddr* address, socklen_t size) {
  if (::connect(fd, address, size) < 0) return errno == EAGAIN;  // a full queue is somebody's
  ucred holder{};
  socklen_t length = sizeof holder;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &holder, &length) != 0) return true;
  constexpr uid_t kFirstOfPeople = 1000;
  return holder.uid < kFirstOfPeople || holder.uid == ::geteuid();
}

}  // namespace

// An abstract UNIX address: nothing stays behind in a file system. Listening tells whose it is.
int LinuxKernel::hold_name(const char* name) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(std::strlen(name), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path + 1, name, length);
  const int fd = or_errno(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (fd < 0) return fd;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  const auto* const place = reinterpret_cast<const sockaddr*>(&address);
  int held = or_errno(::bind(fd, place, size));
  if (held >= 0) held = or_errno(::listen(fd, 1));
  if (held >= 0) return fd;
  if (held == -EADDRINUSE && !is_held_by_ours(fd, place, size)) held = -EPERM;
  close(fd);
  return held;
}

int LinuxKernel::lock(int fd) noexcept { return or_errno(::flock(fd, LOCK_EX | LOCK_NB)); }

std::int64_t LinuxKernel::device_number(int fd) noexcept {
  struct stat status {};
  if (::fstat(fd, &status) != 0 || !S_ISCHR(status.st_mode)) return 0;
  return static_cast<std::int64_t>(status.st_rdev);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    reset();
    kernel_ = other.kernel_;
    fd_ = other.fd_;
    other.fd_ = -1;
  }
  return *this;
}

void Descriptor::reset() noexcept {
  if (fd_ >= 0) kernel_->close(fd_);
  fd_ = -1;
}

}  // namespace ftcs::platform
