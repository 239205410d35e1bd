// SPDX-License-Identifier: MIT
#include "ftcs/platform/ntp_feed.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

#include "ftcs/time/duration.h"

namespace ftcs::platform {
namespace {

constexpr int kFinestPrecision = -30;

/// As chrony's programs expect it in memory, in this machine's byte order.
struct SockSample {
  timeval time;
  double offset;
  int pulse;
  int leap;
  int padding;
  int magic;
};
static_assert(sizeof(SockSample) == ChronySocket::kSize);
constexpr int kMagic = 0x534f434b;  // "SOCK"

// NTP's leap indicator: 1, the last minute has 61 seconds; 2, 59.
int leap_indicator(int leap) { return leap > 0 ? 1 : (leap < 0 ? 2 : 0); }

std::int64_t floor_seconds(std::int64_t ns) {
  return ns / kNsPerSecond - (ns % kNsPerSecond < 0 ? 1 : 0);
}

}  // namespace

int ntp_precision(double sigma_s) noexcept {
  if (!(sigma_s > 0.0)) return 0;  // nothing is known: a second
  return std::clamp(static_cast<int>(std::ceil(std::log2(sigma_s))), kFinestPrecision, 0);
}

Result<ChronySocket, OsError> ChronySocket::open(std::string path) {
  if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path)) {
    return os_error(ENAMETOOLONG, "socket " + path);
  }
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  if (fd < 0) return os_error(errno, "socket " + path);
  ::fcntl(fd, F_SETFL, O_NONBLOCK);
  ::fcntl(fd, F_SETFD, FD_CLOEXEC);
  return ChronySocket(fd, std::move(path));
}

ChronySocket::ChronySocket(ChronySocket&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)) {}

ChronySocket::~ChronySocket() {
  if (fd_ >= 0) ::close(fd_);
}

std::array<std::uint8_t, ChronySocket::kSize> ChronySocket::encode(
    const NtpSample& sample) noexcept {
  SockSample out{};
  const std::int64_t seconds = floor_seconds(sample.system_ns);
  out.time.tv_sec = seconds;
  // The difference of two clocks does not change within the microsecond that is cut off.
  out.time.tv_usec = (sample.system_ns - seconds * kNsPerSecond) / 1000;
  out.offset = sample.behind.seconds();
  out.leap = leap_indicator(sample.leap);
  out.magic = kMagic;
  std::array<std::uint8_t, kSize> bytes;
  std::memcpy(bytes.data(), &out, kSize);
  return bytes;
}

std::optional<OsError> ChronySocket::send(const NtpSample& sample) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path_.data(), path_.size());
  const auto bytes = encode(sample);
  // Not connected: a chronyd that starts anew is found again.
  if (::sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address),
               sizeof address) >= 0) {
    return std::nullopt;
  }
  return os_error(errno, "socket " + path_);
}

/// The layout that ntpd published; integers and time_t of this machine.
struct NtpShm::Segment {
  int mode;
  std::atomic<int> count;
  std::time_t clock_s;
  int clock_us;
  std::time_t receive_s;
  int receive_us;
  int leap;
  int precision;
  int samples;
  std::atomic<int> valid;
  unsigned clock_ns;
  unsigned receive_ns;
  int reserved[8];
};

Result<NtpShm, OsError> NtpShm::open(int unit) {
  static_assert(sizeof(std::atomic<int>) == sizeof(int) && std::atomic<int>::is_always_lock_free);
  static_assert(sizeof(Segment) == 96);
  constexpr key_t kKey = 0x4e545030;  // "NTP0"
  const std::string what = "shared memory unit " + std::to_string(unit);
  const int mode = unit < 2 ? 0600 : 0666;
  const int id = ::shmget(kKey + unit, sizeof(Segment), IPC_CREAT | mode);
  if (id < 0) return os_error(errno, what);
  void* const memory = ::shmat(id, nullptr, 0);
  if (reinterpret_cast<std::intptr_t>(memory) == -1) return os_error(errno, what);
  auto* const segment = static_cast<Segment*>(memory);
  segment->valid.store(0);
  segment->mode = 1;
  segment->samples = 3;  // what ntpd's own writers say; readers of mode 1 do not use it
  return NtpShm(segment);
}

NtpShm::NtpShm(NtpShm&& other) noexcept : segment_(std::exchange(other.segment_, nullptr)) {}

NtpShm::~NtpShm() {
  if (segment_ == nullptr) return;
  segment_->valid.store(0);  // nobody shall take an old sample for a new one
  ::shmdt(segment_);
}

void NtpShm::write(const NtpSample& sample) noexcept {
  Segment& out = *segment_;
  const std::int64_t system_s = floor_seconds(sample.system_ns);
  const std::int64_t reference_ns = sample.system_ns + sample.behind.rounded_ns();
  const std::int64_t reference_s = floor_seconds(reference_ns);
  out.valid.store(0);
  out.count.fetch_add(1);
  out.receive_s = system_s;
  out.receive_ns = static_cast<unsigned>(sample.system_ns - system_s * kNsPerSecond);
  out.receive_us = static_cast<int>(out.receive_ns / 1000);
  out.clock_s = reference_s;
  out.clock_ns = static_cast<unsigned>(reference_ns - reference_s * kNsPerSecond);
  out.clock_us = static_cast<int>(out.clock_ns / 1000);
  out.leap = leap_indicator(sample.leap);
  out.precision = ntp_precision(sample.sigma_s);
  out.count.fetch_add(1);
  out.valid.store(1);
}

}  // namespace ftcs::platform
