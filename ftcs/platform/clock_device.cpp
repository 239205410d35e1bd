// SPDX-License-Identifier: MIT
#include "ftcs/platform/clock_device.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fcntl.h>
#include <limits>
#include <linux/ptp_clock.h>
#include <sys/sysmacros.h>
#include <utility>

#include "ftcs/platform/network_interface.h"
#include "ftcs/time/duration.h"

namespace ftcs::platform {
namespace {

constexpr double kScaledPerPpm = 65536.0;  // timex.freq counts in 2^-16 ppm
// Of timex.tick: microseconds per 1/100 s (USER_HZ) on every architecture that has PTP hardware.
constexpr long kNominalTick = 10'000;
constexpr double kPpmPerTick = 100.0;
constexpr double kLargestFrequencyPpm = 500.0;   // the kernel's MAXFREQ
constexpr double kLargestSystemPpm = 100'000.0;  // the kernel permits ±10 % of the tick

// The kernel's rule for the id of a clock behind a file descriptor (man 2 clock_getres, dynamic
// clocks).
clockid_t clock_id_of(int fd) noexcept {
  constexpr unsigned kClockFd = 3;
  return static_cast<clockid_t>((~static_cast<unsigned>(fd) << 3) | kClockFd);
}

ClockError clock_error(int number) noexcept {
  switch (number) {
    case EPERM:
    case EACCES:
      return ClockError::kNotPermitted;
    case ENODEV:
    case ENXIO:
    case ENOENT:
      return ClockError::kGone;
    case ERANGE:
    case EINVAL:
      return ClockError::kRateOutOfLimits;
    default:
      return ClockError::kBusy;  // EBUSY, and whatever a driver refuses for now
  }
}

OsError device_error(int number, const std::string& name) {
  OsError error = os_error(number, name);
  if (number == ENOENT || number == ENODEV || number == ENXIO) {
    error.kind = OsErrorKind::kNoSuchDevice;
  }
  return error;
}

struct Frequency {
  long tick = kNominalTick;
  long freq = 0;
  [[nodiscard]] Rate rate() const noexcept {
    const double ticks = static_cast<double>(tick - kNominalTick) * kPpmPerTick;
    return Rate::from_ppm(ticks + static_cast<double>(freq) / kScaledPerPpm);
  }
};

Frequency system_frequency(Rate rate) noexcept {
  Frequency result;
  double ppm = rate.ppm();
  if (std::abs(ppm) > kLargestFrequencyPpm) {
    const double ticks = std::round(ppm / kPpmPerTick);
    result.tick += static_cast<long>(ticks);
    ppm -= ticks * kPpmPerTick;
  }
  result.freq = std::lround(ppm * kScaledPerPpm);
  return result;
}

}  // namespace

Result<ClockDevice, OsError> ClockDevice::open_system(Kernel& kernel, ClockAccess access) {
  ClockDevice device(kernel, "CLOCK_REALTIME", CLOCK_REALTIME);
  device.limits_ = RateLimits::symmetric_ppb(kLargestSystemPpm * 1e3);
  if (access == ClockAccess::kSteer) {
    if (auto error = device.probe_rights()) return std::move(*error);
    if (auto error = device.hold()) return std::move(*error);
  }
  return device;
}

Result<ClockDevice, OsError> ClockDevice::open_phc(Kernel& kernel, const std::string& path,
                                                   ClockAccess access) {
  const int fd = kernel.open(path.c_str(), access == ClockAccess::kSteer ? O_RDWR : O_RDONLY);
  if (fd < 0) return device_error(-fd, path);
  ClockDevice device(kernel, path, clock_id_of(fd));
  device.device_ = Descriptor(kernel, fd);
  device.number_ = kernel.device_number(fd);
  ptp_clock_caps capabilities{};
  if (const int result = kernel.control(fd, PTP_CLOCK_GETCAPS, &capabilities); result < 0) {
    OsError error = device_error(-result, path);
    if (result == -ENOTTY || result == -EINVAL) {
      error.what += ": not a PTP hardware clock";
      error.kind = OsErrorKind::kSystem;
    }
    return error;
  }
  // Rounding must not lead beyond what the driver takes, and a rate stays above zero.
  const double largest_ppb = std::min(static_cast<double>(capabilities.max_adj), 999'000'000.0);
  device.limits_ = RateLimits::symmetric_ppb(std::max(largest_ppb, 0.0));
  if (access == ClockAccess::kSteer) {
    if (capabilities.max_adj <= 0) {
      return OsError{OsErrorKind::kSystem, EOPNOTSUPP, path + " (its frequency is fixed)"};
    }
    if (auto error = device.hold()) return std::move(*error);
  }
  return device;
}

Result<ClockDevice, OsError> ClockDevice::open_phc_of(Kernel& kernel, const std::string& interface,
                                                      ClockAccess access) {
  const auto capabilities = interface_capabilities(kernel, interface);
  if (!capabilities) return capabilities.error();
  if (capabilities->phc_index < 0) {
    return OsError{OsErrorKind::kSystem, EOPNOTSUPP,
                   "interface " + interface + ": no PTP hardware clock"};
  }
  return open_phc(kernel, "/dev/ptp" + std::to_string(capabilities->phc_index), access);
}

// Two servos on one clock would fight. The node of a hardware clock is locked, which other mount
// and network namespaces with the same node see. Nodes may be many, and the system clock has none:
// so the clock itself is held too, as a name, and as a file that other network namespaces see.
// Where names cannot be held (a simulator without UNIX sockets) the clock is not this machine's.
std::optional<OsError> ClockDevice::hold() {
  const auto busy = [this] { return os_error(EADDRINUSE, name_); };
  if (!is_system() && kernel_->lock(device_.get()) == -EWOULDBLOCK) return busy();
  const std::string clock = identity();
  if (clock.empty()) return std::nullopt;
  const int held = kernel_->hold_name(("ftcs clock " + clock).c_str());
  if (held == -EADDRINUSE) return busy();
  if (held < 0 && held != -EPERM) return std::nullopt;
  if (held >= 0)
    hold_ = Descriptor(*kernel_, held);  // else a stranger has the name: the file counts
  const std::string path = "/run/ftcs-clock-" + clock + ".lock";
  const int file = kernel_->open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) return std::nullopt;
  lock_file_ = Descriptor(*kernel_, file);
  if (kernel_->lock(file) == -EWOULDBLOCK) return busy();
  return std::nullopt;
}

// The one that follows is held already: whoever has the same two can only be the other way round.
std::optional<Descriptor> ClockDevice::hold_pair_with(const ClockDevice& other) {
  const std::string ours = identity();
  const std::string theirs = other.identity();
  if (ours.empty() || theirs.empty()) return Descriptor{};
  const std::string pair = "ftcs pair " + std::min(ours, theirs) + " " + std::max(ours, theirs);
  const int held = kernel_->hold_name(pair.c_str());
  if (held == -EADDRINUSE) return std::nullopt;
  return held >= 0 ? Descriptor(*kernel_, held) : Descriptor{};
}

std::string ClockDevice::identity() const {
  if (is_system()) return "realtime";
  if (number_ <= 0) return {};
  const auto number = static_cast<dev_t>(number_);
  return "ptp-" + std::to_string(major(number)) + "-" + std::to_string(minor(number));
}

bool ClockDevice::is_same_clock(const ClockDevice& other) const {
  const std::string ours = identity();
  const std::string theirs = other.identity();
  return ours.empty() || theirs.empty() ? name_ == other.name_ : ours == theirs;
}

// A tick of zero is refused whatever the clock; whether as EPERM or as EINVAL tells the rights, and
// nothing has changed either way.
std::optional<OsError> ClockDevice::probe_rights() {
  timex request{};
  request.modes = ADJ_TICK;
  const int result = kernel_->adjust_clock(id_, request);
  if (result == -EPERM || result == -EACCES)
    return os_error(-result, "steering " + name_ + " (CAP_SYS_TIME)");
  return std::nullopt;
}

std::optional<ClockError> ClockDevice::failed(int result) noexcept {
  if (result >= 0) return std::nullopt;
  error_number_ = -result;
  return clock_error(-result);
}

std::optional<std::int64_t> ClockDevice::read_clock() noexcept {
  const std::int64_t now = kernel_->clock_ns(id_);
  return now == 0 ? std::nullopt : std::optional(now);
}

// The kernel itself says which rate a clock has, as long as that is there; only a reading needs the
// driver, which may be held up by something else.
ClockError ClockDevice::why_unread() noexcept {
  const auto answer = rate();
  return answer ? ClockError::kBusy : answer.error();
}

std::optional<ClockDevice::Reading> ClockDevice::read_once() noexcept {
  const std::int64_t before = read_raw();
  const auto clock = read_clock();
  const std::int64_t after = read_raw();
  if (!clock) return std::nullopt;
  return Reading{*clock, before + (after - before) / 2, after - before};
}

// A bus access takes a microsecond and more: one that is about as quick as the quickest of earlier
// calls is enough.
Result<ClockDevice::Reading, ClockError> ClockDevice::read() noexcept {
  constexpr int kReadings = 5;
  const std::int64_t enough = quickest_ns_ + quickest_ns_ / 4;
  Reading best{0, 0, std::numeric_limits<std::int64_t>::max()};
  for (int i = 0; i < kReadings && best.width_ns > enough; ++i) {
    const auto reading = read_once();
    if (reading && reading->width_ns < best.width_ns) best = *reading;
  }
  if (best.width_ns == std::numeric_limits<std::int64_t>::max()) return why_unread();
  quickest_ns_ = enough == 0 ? best.width_ns : std::min(quickest_ns_, best.width_ns);
  return best;
}

Result<Rate, ClockError> ClockDevice::rate() noexcept {
  timex request{};
  if (const auto error = failed(kernel_->adjust_clock(id_, request))) return *error;
  return Frequency{is_system() ? request.tick : kNominalTick, request.freq}.rate();
}

// A driver that is busy mostly takes the next command.
int ClockDevice::change(const timex& wanted) noexcept {
  constexpr int kAttempts = 5;
  int result = -EBUSY;
  for (int i = 0; i < kAttempts && (result == -EBUSY || result == -EAGAIN); ++i) {
    timex request = wanted;
    result = kernel_->adjust_clock(id_, request);
  }
  return result;
}

Result<Rate, ClockError> ClockDevice::set_rate(Rate rate) noexcept {
  if (!limits_.contains(rate)) return ClockError::kRateOutOfLimits;
  Frequency wanted;
  timex request{};
  request.modes = ADJ_FREQUENCY;
  if (is_system()) {
    wanted = system_frequency(rate);
    request.modes |= ADJ_TICK;
    request.tick = wanted.tick;
  } else {
    wanted.freq = static_cast<long>(rate.ppm() * kScaledPerPpm);  // towards zero: within the limits
  }
  request.freq = wanted.freq;
  if (const auto error = failed(change(request))) return *error;
  return wanted.rate();
}

std::optional<ClockError> ClockDevice::step(Duration by) noexcept {
  const std::int64_t ns = by.rounded_ns();
  timex request{};
  request.modes = ADJ_SETOFFSET | ADJ_NANO;
  request.time.tv_sec = ns / kNsPerSecond;
  request.time.tv_usec = ns % kNsPerSecond;  // nanoseconds, by ADJ_NANO
  if (request.time.tv_usec < 0) {
    request.time.tv_usec += kNsPerSecond;
    --request.time.tv_sec;
  }
  return failed(change(request));
}

}  // namespace ftcs::platform
