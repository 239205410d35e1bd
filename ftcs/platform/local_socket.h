// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <sys/types.h>
#include <vector>

#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// A UNIX datagram socket with a name in the file system, as linuxptp's and chrony's programs talk
/// through. Never blocks; the file goes with the object.
class LocalSocket {
 public:
  /// A file that a dead program left behind is replaced; one that somebody serves is
  /// kAddressInUse, and so is a file that is no socket. Owner and group may write to it.
  [[nodiscard]] static Result<LocalSocket, OsError> bind(const std::string& path);
  /// Bound to a file of its own in a new folder: beside `server`, whom it is to ask, where we may
  /// write there, as a service may have a /tmp of its own; else under $TMPDIR or /tmp. It can be
  /// answered from another network namespace too: by root, by our own user, and, once something was
  /// sent to it, by the group of a server's socket.
  [[nodiscard]] static Result<LocalSocket, OsError> client(const std::string& server = {});

  LocalSocket(LocalSocket&& other) noexcept;
  LocalSocket& operator=(LocalSocket&& other) noexcept;
  LocalSocket(const LocalSocket&) = delete;
  LocalSocket& operator=(const LocalSocket&) = delete;
  ~LocalSocket();

  struct Datagram {
    std::span<const std::uint8_t> bytes;  ///< valid until the next call
    std::string sender;                   ///< its path; empty if it has none: no answer possible
  };
  /// No value: there is none.
  [[nodiscard]] std::optional<Datagram> receive();
  /// Waits at most so long for a datagram; a signal ends the wait too.
  void wait(int milliseconds) const;
  /// Nobody there (ENOENT, ECONNREFUSED) and a full queue (EAGAIN) are errors as any other.
  std::optional<OsError> send(const std::string& path, std::span<const std::uint8_t> bytes);

  [[nodiscard]] int descriptor() const noexcept { return fd_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  LocalSocket(int fd, std::string path, std::string folder);
  void let_answer(const std::string& server);
  void close() noexcept;

  int fd_ = -1;
  std::vector<std::uint8_t> buffer_;
  std::string path_{};
  std::string folder_{};              ///< of a client: removed too
  ino_t inode_ = 0;                   ///< somebody may have put another file in our place
  std::optional<gid_t> answerers_{};  ///< the group that may write to a client
};

/// Where a program's socket is looked for, in this order: /var/run, $XDG_RUNTIME_DIR.
[[nodiscard]] std::vector<std::string> usual_socket_paths(const std::string& name);
/// The first of them whose folder this process may write to; empty: there is none.
[[nodiscard]] std::string writable_socket_path(const std::string& name);

}  // namespace ftcs::platform
