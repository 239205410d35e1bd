// SPDX-License-Identifier: MIT
#include "ftcs/platform/local_socket.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr mode_t kMode = 0660;
constexpr mode_t kFolderMode = 0710;             // of a client whose server's group may answer
constexpr std::size_t kLongestDatagram = 65536;  // longer ones are cut, and so not understood

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return std::nullopt;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

OsError path_error(int number, const std::string& path) {
  // Files know permissions alone; what else is known of errors is about networks and clocks.
  const bool in_use = number == EADDRINUSE;
  return {in_use ? OsErrorKind::kAddressInUse : OsErrorKind::kSystem, number, "socket " + path};
}

/// A datagram socket, or -errno. Not SOCK_NONBLOCK: network simulators know plain types only.
int open_socket() {
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  if (fd < 0) return -errno;
  ::fcntl(fd, F_SETFL, O_NONBLOCK);
  ::fcntl(fd, F_SETFD, FD_CLOEXEC);
  return fd;
}

/// Whether the file at this address is a socket that nobody serves any more.
bool is_abandoned(const sockaddr_un& address) {
  struct stat file {};
  if (::lstat(address.sun_path, &file) != 0 || !S_ISSOCK(file.st_mode)) return false;
  const int probe = open_socket();
  if (probe < 0) return false;
  const bool refused =
      ::connect(probe, generic(address), sizeof address) != 0 && errno == ECONNREFUSED;
  ::close(probe);
  return refused;
}

ino_t inode_of(const std::string& path) {
  struct stat file {};
  return ::lstat(path.c_str(), &file) == 0 ? file.st_ino : 0;
}

/// bind(2) with the mode that the file is to have: there is no moment in which others may write.
/// 0 or -errno.
int bind_with_mode(int fd, const sockaddr_un& address) {
  const mode_t usual = ::umask(~kMode & 0777U);  // one thread
  const int result = ::bind(fd, generic(address), sizeof address) == 0 ? 0 : -errno;
  ::umask(usual);
  return result;
}

/// Puts a socket in the place of one that nobody serves. Two programs that find the same left-over
/// must not remove each other's new socket: the folder is held meanwhile. 0 or -errno.
int replace_abandoned(int fd, const sockaddr_un& address) {
  const std::string path = address.sun_path;
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const int hold = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (hold < 0) return -errno;
  int result = -EADDRINUSE;
  if (::flock(hold, LOCK_EX | LOCK_NB) == 0 && is_abandoned(address)) {
    result = ::unlink(address.sun_path) == 0 ? bind_with_mode(fd, address) : -errno;
  }
  ::close(hold);
  return result;
}

/// 0 or -errno.
int bind_to(int fd, const sockaddr_un& address) {
  const int result = bind_with_mode(fd, address);
  return result == -EADDRINUSE ? replace_abandoned(fd, address) : result;
}

}  // namespace

LocalSocket::LocalSocket(int fd, std::string path, std::string folder)
    : fd_(fd),
      buffer_(kLongestDatagram),
      path_(std::move(path)),
      folder_(std::move(folder)),
      inode_(inode_of(path_)) {}

Result<LocalSocket, OsError> LocalSocket::bind(const std::string& path) {
  const auto address = address_of(path);
  if (!address) return path_error(ENAMETOOLONG, path);
  const int fd = open_socket();
  if (fd < 0) return path_error(-fd, path);
  if (const int result = bind_to(fd, *address); result < 0) {
    ::close(fd);
    return path_error(-result, path);
  }
  return LocalSocket(fd, path, "");
}

namespace {

std::string folder_for_client(const std::string& server) {
  const std::size_t slash = server.rfind('/');
  if (slash != std::string::npos && slash > 0) {
    std::string beside = server.substr(0, slash);
    if (::access(beside.c_str(), W_OK) == 0) return beside;
  }
  const char* const given = std::getenv("TMPDIR");  // one thread
  return given != nullptr && *given != '\0' ? given : "/tmp";
}

}  // namespace

Result<LocalSocket, OsError> LocalSocket::client(const std::string& server) {
  std::string folder = folder_for_client(server) + "/ftcs-XXXXXX";
  if (::mkdtemp(folder.data()) == nullptr) return path_error(errno, folder);
  const std::string path = folder + "/socket";
  const auto address = address_of(path);
  const int fd = address ? open_socket() : -ENAMETOOLONG;
  const int result = fd < 0 ? fd : bind_to(fd, *address);
  if (result < 0) {
    if (fd >= 0) ::close(fd);
    ::rmdir(folder.c_str());
    return path_error(-result, path);
  }
  return LocalSocket(fd, path, folder);
}

LocalSocket::LocalSocket(LocalSocket&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      buffer_(std::move(other.buffer_)),
      path_(std::move(other.path_)),
      folder_(std::move(other.folder_)),
      inode_(other.inode_),
      answerers_(other.answerers_) {}

LocalSocket& LocalSocket::operator=(LocalSocket&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
    buffer_ = std::move(other.buffer_);
    path_ = std::move(other.path_);
    folder_ = std::move(other.folder_);
    inode_ = other.inode_;
    answerers_ = other.answerers_;
  }
  return *this;
}

LocalSocket::~LocalSocket() { close(); }

void LocalSocket::close() noexcept {
  if (fd_ < 0) return;
  if (inode_ != 0 && inode_of(path_) == inode_) ::unlink(path_.c_str());
  if (!folder_.empty()) ::rmdir(folder_.c_str());
  ::close(fd_);
  fd_ = -1;
}

std::optional<LocalSocket::Datagram> LocalSocket::receive() {
  sockaddr_un sender{};
  socklen_t length = sizeof sender;
  const ssize_t size = ::recvfrom(fd_, buffer_.data(), buffer_.size(), 0,
                                  reinterpret_cast<sockaddr*>(&sender), &length);
  if (size < 0) return std::nullopt;
  Datagram datagram{{buffer_.data(), static_cast<std::size_t>(size)}, {}};
  if (length > offsetof(sockaddr_un, sun_path)) {
    const std::size_t room = length - offsetof(sockaddr_un, sun_path);
    datagram.sender.assign(sender.sun_path, ::strnlen(sender.sun_path, room));
  }
  return datagram;
}

void LocalSocket::wait(int milliseconds) const {
  pollfd entry{fd_, POLLIN, 0};
  (void)::poll(&entry, 1, milliseconds);
}

// As we may write to a server's socket by its group, so its group may write to ours. Where the
// group is not ours to give, the server must be root or of our own user.
void LocalSocket::let_answer(const std::string& server) {
  struct stat file {};
  if (::stat(server.c_str(), &file) != 0 || answerers_ == file.st_gid) return;
  const auto same_user = static_cast<uid_t>(-1);
  if (::chown(path_.c_str(), same_user, file.st_gid) != 0) return;
  if (::chown(folder_.c_str(), same_user, file.st_gid) != 0) return;
  if (::chmod(folder_.c_str(), kFolderMode) == 0) answerers_ = file.st_gid;
}

std::optional<OsError> LocalSocket::send(const std::string& path,
                                         std::span<const std::uint8_t> bytes) {
  const auto address = address_of(path);
  if (!address) return path_error(ENAMETOOLONG, path);
  if (!folder_.empty()) let_answer(path);
  const ssize_t sent =
      ::sendto(fd_, bytes.data(), bytes.size(), 0, generic(*address), sizeof *address);
  if (sent >= 0) return std::nullopt;
  return path_error(errno, path);
}

std::vector<std::string> usual_socket_paths(const std::string& name) {
  std::vector<std::string> paths{"/var/run/" + name};
  const char* const own = std::getenv("XDG_RUNTIME_DIR");
  if (own != nullptr && *own != '\0') paths.push_back(std::string(own) + "/" + name);
  return paths;
}

std::string writable_socket_path(const std::string& name) {
  for (const std::string& path : usual_socket_paths(name)) {
    if (::access(path.substr(0, path.rfind('/')).c_str(), W_OK) == 0) return path;
  }
  return "";
}

}  // namespace ftcs::platform
