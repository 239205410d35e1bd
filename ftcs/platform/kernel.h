// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <ctime>
#include <netinet/in.h>
#include <poll.h>
#include <span>
#include <sys/socket.h>
#include <sys/types.h>

namespace ftcs::platform {

/// Every system call that this layer makes, so that a test can let each of them fail.
///
/// A negative result is -errno. The set is kept to what a network simulator that replaces libc's
/// calls offers too: poll, plain datagram sockets, ioctl; no threads, netlink, epoll or signalfd.
class Kernel {
 public:
  virtual ~Kernel() = default;

  /// Nanoseconds since the clock's epoch; -errno does not exist here: a clock that cannot be read
  /// reads 0.
  [[nodiscard]] virtual std::int64_t clock_ns(clockid_t clock) noexcept = 0;
  [[nodiscard]] virtual int socket(int domain, int type) noexcept = 0;
  [[nodiscard]] virtual int bind(int fd, const sockaddr_in& address) noexcept = 0;
  [[nodiscard]] virtual int set_option(int fd, int level, int name, const void* value,
                                       socklen_t size) noexcept = 0;
  [[nodiscard]] virtual int set_nonblocking(int fd) noexcept = 0;
  [[nodiscard]] virtual ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                                        const sockaddr_in& to) noexcept = 0;
  [[nodiscard]] virtual ssize_t receive(int fd, msghdr& message, int flags) noexcept = 0;
  [[nodiscard]] virtual int control(int fd, unsigned long request, void* argument) noexcept = 0;
  [[nodiscard]] virtual int open(const char* path, int flags) noexcept = 0;
  [[nodiscard]] virtual int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept = 0;
  virtual void close(int fd) noexcept = 0;

 protected:
  Kernel() = default;
  Kernel(const Kernel&) = default;
  Kernel& operator=(const Kernel&) = default;
};

/// The running system, through libc.
class LinuxKernel final : public Kernel {
 public:
  [[nodiscard]] std::int64_t clock_ns(clockid_t clock) noexcept override;
  [[nodiscard]] int socket(int domain, int type) noexcept override;
  [[nodiscard]] int bind(int fd, const sockaddr_in& address) noexcept override;
  [[nodiscard]] int set_option(int fd, int level, int name, const void* value,
                               socklen_t size) noexcept override;
  [[nodiscard]] int set_nonblocking(int fd) noexcept override;
  [[nodiscard]] ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                                const sockaddr_in& to) noexcept override;
  [[nodiscard]] ssize_t receive(int fd, msghdr& message, int flags) noexcept override;
  [[nodiscard]] int control(int fd, unsigned long request, void* argument) noexcept override;
  [[nodiscard]] int open(const char* path, int flags) noexcept override;
  [[nodiscard]] int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override;
  void close(int fd) noexcept override;
};

/// Owns a file descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  Descriptor(Kernel& kernel, int fd) noexcept : kernel_(&kernel), fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : kernel_(other.kernel_), fd_(other.fd_) {
    other.fd_ = -1;
  }
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { reset(); }

  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  void reset() noexcept;

 private:
  Kernel* kernel_ = nullptr;
  int fd_ = -1;
};

}  // namespace ftcs::platform
