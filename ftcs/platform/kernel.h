// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <ctime>
#include <poll.h>
#include <span>
#include <sys/socket.h>
#include <sys/timex.h>
#include <sys/types.h>

#include "ftcs/platform/socket_address.h"

namespace ftcs::platform {

/// The system calls behind clocks, timestamps and the network, so that a test can let each of them
/// fail. Management sockets, processes and files of ours (local_socket.h, child_process.h,
/// durable_file.h) call the system themselves and are tested with the real one; none of them asks
/// for the time.
///
/// A negative result is -errno. For PTP the set is kept to what a network simulator that replaces
/// libc's calls offers too: poll, plain datagram sockets, ioctl; no threads, netlink, epoll or
/// signalfd. (Packet sockets, which no such simulator knows, are datagram sockets here too.) A
/// cyclic task asks for what poll's milliseconds are too coarse for: sleep_until, wait_readable.
class Kernel {
 public:
  virtual ~Kernel() = default;

  /// Nanoseconds since the clock's epoch; -errno does not exist here: a clock that cannot be read
  /// reads 0.
  [[nodiscard]] virtual std::int64_t clock_ns(clockid_t clock) noexcept = 0;
  [[nodiscard]] virtual int socket(int domain, int type) noexcept = 0;
  [[nodiscard]] virtual int bind(int fd, const SocketAddress& address) noexcept = 0;
  /// Of a datagram socket: where its messages go, and whose it takes from now on.
  [[nodiscard]] virtual int connect(int fd, const SocketAddress& address) noexcept = 0;
  /// The UDP port that the socket is bound to, in host order; 0: none.
  [[nodiscard]] virtual std::uint16_t port_of(int fd) noexcept = 0;
  [[nodiscard]] virtual int set_option(int fd, int level, int name, const void* value,
                                       socklen_t size) noexcept = 0;
  [[nodiscard]] virtual int set_nonblocking(int fd) noexcept = 0;
  /// An empty `to`: where the socket is connected or bound to.
  [[nodiscard]] virtual ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                                        const SocketAddress& to) noexcept = 0;
  [[nodiscard]] virtual ssize_t receive(int fd, msghdr& message, int flags) noexcept = 0;
  [[nodiscard]] virtual int control(int fd, unsigned long request, void* argument) noexcept = 0;
  [[nodiscard]] virtual int open(const char* path, int flags) noexcept = 0;
  [[nodiscard]] virtual int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept = 0;
  /// Until the descriptor is readable or in error, `timeout_ns` at most. Positive: it is; 0: the
  /// time is over.
  [[nodiscard]] virtual int wait_readable(int fd, std::int64_t timeout_ns) noexcept = 0;
  /// Returns when CLOCK_MONOTONIC shows `instant_ns`, or earlier because of a signal.
  virtual void sleep_until(std::int64_t instant_ns) noexcept = 0;
  virtual void close(int fd) noexcept = 0;
  [[nodiscard]] virtual ssize_t read(int fd, std::span<std::uint8_t> bytes) noexcept = 0;
  /// clock_adjtime(2): with modes 0 only asks. Fills `request` with what the kernel then holds;
  /// returns the clock's leap state.
  [[nodiscard]] virtual int adjust_clock(clockid_t clock, timex& request) noexcept = 0;
  /// A descriptor that becomes readable when the time of set_timer() has passed on CLOCK_MONOTONIC.
  [[nodiscard]] virtual int open_timer() noexcept = 0;
  [[nodiscard]] virtual int set_timer(int fd, std::int64_t from_now_ns) noexcept = 0;
  /// A name that one process of this host (network namespace) can hold, until the descriptor is
  /// closed or the process ends. -EADDRINUSE: root, a system account or our own user holds it;
  /// -EPERM: somebody else does.
  [[nodiscard]] virtual int hold_name(const char* name) noexcept = 0;
  /// Takes what is open there, file or device, for this process, until the descriptor is closed.
  /// -EWOULDBLOCK: another one has it, under whatever name it was opened.
  [[nodiscard]] virtual int lock(int fd) noexcept = 0;
  /// Which device is open there, whatever its node is called (st_rdev); 0: none, or not known.
  [[nodiscard]] virtual std::int64_t device_number(int fd) noexcept = 0;

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
  [[nodiscard]] int bind(int fd, const SocketAddress& address) noexcept override;
  [[nodiscard]] int connect(int fd, const SocketAddress& address) noexcept override;
  [[nodiscard]] std::uint16_t port_of(int fd) noexcept override;
  [[nodiscard]] int set_option(int fd, int level, int name, const void* value,
                               socklen_t size) noexcept override;
  [[nodiscard]] int set_nonblocking(int fd) noexcept override;
  [[nodiscard]] ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                                const SocketAddress& to) noexcept override;
  [[nodiscard]] ssize_t receive(int fd, msghdr& message, int flags) noexcept override;
  [[nodiscard]] int control(int fd, unsigned long request, void* argument) noexcept override;
  [[nodiscard]] int open(const char* path, int flags) noexcept override;
  [[nodiscard]] int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override;
  [[nodiscard]] int wait_readable(int fd, std::int64_t timeout_ns) noexcept override;
  void sleep_until(std::int64_t instant_ns) noexcept override;
  void close(int fd) noexcept override;
  [[nodiscard]] ssize_t read(int fd, std::span<std::uint8_t> bytes) noexcept override;
  [[nodiscard]] int adjust_clock(clockid_t clock, timex& request) noexcept override;
  [[nodiscard]] int open_timer() noexcept override;
  [[nodiscard]] int set_timer(int fd, std::int64_t from_now_ns) noexcept override;
  [[nodiscard]] int hold_name(const char* name) noexcept override;
  [[nodiscard]] int lock(int fd) noexcept override;
  [[nodiscard]] std::int64_t device_number(int fd) noexcept override;
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
