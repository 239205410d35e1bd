// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <linux/ptp_clock.h>
#include <set>
#include <string>

#include "test/support/fake_kernel.h"

namespace ftcs::platform {

/// FakeKernel with clocks that can be steered: CLOCK_REALTIME on the oscillator of
/// CLOCK_MONOTONIC_RAW, /dev/ptp0 and /dev/ptp1 on one of their own each. `ideal` time is what
/// advance() counts.
class FakeClocks : public FakeKernel {
 public:
  struct Clock {
    double time_ns = 0.0;
    double oscillator = 1.0;  ///< unsteered rate against ideal time
    /// What a kernel multiplies cycles by is an integer: the clock runs at a multiple of this, and
    /// at one more while it owes time to what was asked for. That is decided at ticks, of which an
    /// idle processor has none, and when a rate is set. Zero: any rate.
    double multiplier_unit = 0.0;
    /// A register makes the nearest multiple of this of what is commanded. Zero: any rate.
    double rate_step = 0.0;
    double owed_ns = 0.0;
    bool catches_up = false;
    long tick = 10'000;
    long freq = 0;
    int status = STA_UNSYNC;
    int tai = 0;
    long maxerror = 0;
    long esterror = 0;
    [[nodiscard]] double steering() const {
      return 1.0 + static_cast<double>(tick - 10'000) * 1e-4 +
             static_cast<double>(freq) / 65536.0 * 1e-6;
    }
    [[nodiscard]] double rate() const {
      if (rate_step > 0.0) return 1.0 + std::round((steering() - 1.0) / rate_step) * rate_step;
      if (multiplier_unit == 0.0) return steering();
      return (std::floor(steering() / multiplier_unit) + (catches_up ? 1.0 : 0.0)) *
             multiplier_unit;
    }
    void advance(double ns) {
      time_ns += ns * oscillator * rate();
      owed_ns += ns * oscillator * (steering() - rate());
    }
    void decide() { catches_up = owed_ns > 0.0; }
  };

  // Relative to an epoch, so that a double resolves them.
  static constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;
  Clock system;
  Clock phc;
  Clock other_phc;  ///< /dev/ptp1
  double raw = 1e12;
  std::int64_t slept_ns = 0;  ///< CLOCK_BOOTTIME - CLOCK_MONOTONIC
  double ideal_ns = 0.0;
  std::int64_t max_adj_ppb = 50'000'000;
  std::int64_t phc_reading_ns = 800;  ///< what it takes to read the hardware clock over the bus

  // Failures.
  int adjust_errno = 0;  ///< of commands; questions are answered
  int phc_open_errno = 0;
  int precise_errno = EOPNOTSUPP;
  int extended_errno = 0;
  int basic_errno = 0;
  bool phc_gone = false;
  std::function<bool()> driver_is_busy;  ///< EBUSY for readings and commands of hardware clocks
  bool busy_by_reading = false;          ///< in a comparison each reading is one more call of it
  bool short_cross_reads = false;
  bool run_folder_is_writable = true;
  bool device_numbers_known = true;
  std::set<std::string> held_names;  ///< and locked descriptors, until they are closed
  int commands = 0;                  ///< adjust_clock() calls that asked for a change and got it
  std::int64_t timer_ns = 0;

  clockid_t last_read = -1;         ///< the clock that was read before the one now being read
  std::function<void()> on_adjust;  ///< before and after each command

  FakeClocks() { reading_ns = 20; }

  void run(double ns) {
    ideal_ns += ns;
    raw += ns * system.oscillator;
    system.advance(ns);
    phc.advance(ns);
    other_phc.advance(ns);
  }
  [[nodiscard]] static double relative(std::int64_t clock_ns) {
    return static_cast<double>(clock_ns - kEpoch);
  }

  std::int64_t clock_ns(clockid_t clock) noexcept override {
    run(static_cast<double>(reading_ns));
    if (on_clock_read) on_clock_read();
    last_read = clock;
    if (clock == CLOCK_REALTIME) return kEpoch + std::llround(system.time_ns);
    if (clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_MONOTONIC) return std::llround(raw);
    if (clock == CLOCK_BOOTTIME) return std::llround(raw) + slept_ns;
    if (phc_gone || is_busy()) return 0;
    run(static_cast<double>(phc_reading_ns) / 2);
    const Clock& read = clock == clock_id_of(kOtherPhcDescriptor) ? other_phc : phc;
    const std::int64_t now = kEpoch + std::llround(read.time_ns);
    run(static_cast<double>(phc_reading_ns) / 2);
    return now;
  }
  int open(const char* path, int) noexcept override {
    const std::string name = path;
    if (run_folder_is_writable && name.starts_with("/run/")) {
      return name.find("realtime") != std::string::npos ? kLockDescriptor : kLockDescriptor + 1;
    }
    if (name.starts_with("/dev/ptp") && phc_open_errno != 0) return -phc_open_errno;
    if (name == "/dev/ptp1") return kOtherPhcDescriptor;
    if (name == "/dev/ptp_node") return kOtherNodeDescriptor;
    return name == "/dev/ptp0" || name == "/dev/ptp_nic" ? kPhcDescriptor : -ENOENT;
  }
  int hold_name(const char* name) noexcept override {
    if (!held_names.insert(name).second) return -EADDRINUSE;
    holds_[next_hold_] = name;
    return next_hold_++;
  }
  int lock(int fd) noexcept override {
    const std::string name = "descriptor " + std::to_string(fd);
    if (!held_names.insert(name).second) return -EWOULDBLOCK;
    holds_[fd] = name;
    return 0;
  }
  void close(int fd) noexcept override {
    if (const auto held = holds_.extract(fd)) held_names.erase(held.mapped());
    FakeKernel::close(fd);
  }
  std::int64_t device_number(int fd) noexcept override {
    constexpr std::int64_t kNumber = 0xF800;
    if (!is_phc(fd) || !device_numbers_known) return 0;
    return fd == kOtherPhcDescriptor ? kNumber + 1 : kNumber;
  }
  int set_timer(int, std::int64_t ns) noexcept override {
    timer_ns = ns;
    return 0;
  }
  /// Waits for the timer, or for the timeout.
  int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override {
    const double timeout = static_cast<double>(timeout_ms) * 1e6;
    const bool woken = timer_ns > 0 && static_cast<double>(timer_ns) <= timeout;
    run(woken ? static_cast<double>(timer_ns) : timeout);
    timer_ns = woken ? 0 : timer_ns - std::llround(timeout);
    system.decide();
    for (pollfd& entry : descriptors) entry.revents = woken && entry.fd >= 0 ? POLLIN : 0;
    if (on_poll) on_poll();
    return woken ? 1 : 0;
  }
  std::function<void()> on_poll;
  int adjust_clock(clockid_t id, timex& request) noexcept override {
    const bool other = id == clock_id_of(kOtherPhcDescriptor);
    Clock& clock = id == CLOCK_REALTIME ? system : other ? other_phc : phc;
    if (&clock != &system && phc_gone) return -ENODEV;
    if (request.modes != 0) {
      if (adjust_errno != 0) return -adjust_errno;
      if (&clock != &system && is_busy()) return -EBUSY;
      if (on_adjust) on_adjust();
      if (const int error = change(clock, request); error != 0) return -error;
      ++commands;
      if (on_adjust) on_adjust();
    }
    request.freq = clock.freq;
    request.tick = &clock == &system ? clock.tick : 0;
    request.status = clock.status;
    request.tai = clock.tai;
    return TIME_OK;
  }
  int control(int fd, unsigned long request, void* argument) noexcept override {
    if (!is_phc(fd)) return FakeKernel::control(fd, request, argument);
    if (phc_gone) return -ENODEV;
    if (request != PTP_CLOCK_GETCAPS && is_busy()) return -EBUSY;
    const Clock& clock = fd == kOtherPhcDescriptor ? other_phc : phc;
    switch (request) {
      case PTP_CLOCK_GETCAPS:
        static_cast<ptp_clock_caps*>(argument)->max_adj = static_cast<int>(max_adj_ppb);
        return 0;
      case PTP_SYS_OFFSET_PRECISE:
        return precise_errno != 0 ? -precise_errno : precise(clock, argument);
      case PTP_SYS_OFFSET_EXTENDED:
        return extended_errno != 0 ? -extended_errno : extended(clock, argument);
      case PTP_SYS_OFFSET:
        return basic_errno != 0 ? -basic_errno : basic(clock, argument);
      default:
        return -ENOTTY;
    }
  }

  static constexpr int kPhcDescriptor = 800;        ///< /dev/ptp0, and /dev/ptp_nic, a link to it
  static constexpr int kOtherNodeDescriptor = 810;  ///< /dev/ptp_node: made for it by mknod
  static constexpr int kOtherPhcDescriptor = 820;   ///< /dev/ptp1
  static constexpr int kLockDescriptor = 801;

 private:
  static ptp_clock_time time_of(const Clock& clock) {
    const std::int64_t now = kEpoch + std::llround(clock.time_ns);
    ptp_clock_time time{};
    time.sec = now / 1'000'000'000;
    time.nsec = static_cast<std::uint32_t>(now % 1'000'000'000);
    return time;
  }
  [[nodiscard]] bool is_busy() const { return driver_is_busy && driver_is_busy(); }
  static bool is_phc(int fd) {
    return fd == kPhcDescriptor || fd == kOtherNodeDescriptor || fd == kOtherPhcDescriptor;
  }
  static clockid_t clock_id_of(int fd) {  // FD_TO_CLOCKID of the kernel
    return static_cast<clockid_t>((~static_cast<unsigned>(fd) << 3) | 3);
  }
  ptp_clock_time read_over_bus(const Clock& clock) {
    run(static_cast<double>(phc_reading_ns) / 2);
    const ptp_clock_time time = time_of(clock);
    run(static_cast<double>(phc_reading_ns) / 2);
    if (on_clock_read) on_clock_read();
    return time;
  }
  int precise(const Clock& clock, void* argument) {
    auto* answer = static_cast<ptp_sys_offset_precise*>(argument);
    if (short_cross_reads) return 0;
    answer->device = time_of(clock);
    answer->sys_realtime = time_of(system);
    return 0;
  }
  int extended(const Clock& clock, void* argument) {
    auto* answer = static_cast<ptp_sys_offset_extended*>(argument);
    if (short_cross_reads) answer->n_samples = 0;
    for (unsigned i = 0; i < answer->n_samples; ++i) {
      if (busy_by_reading && is_busy()) return -EBUSY;
      answer->ts[i][0] = time_of(system);
      answer->ts[i][1] = read_over_bus(clock);
      answer->ts[i][2] = time_of(system);
    }
    return 0;
  }
  int basic(const Clock& clock, void* argument) {
    auto* answer = static_cast<ptp_sys_offset*>(argument);
    if (short_cross_reads) answer->n_samples = 0;
    for (unsigned i = 0; i < answer->n_samples; ++i) {
      if (busy_by_reading && is_busy()) return -EBUSY;
      answer->ts[2 * i] = time_of(system);
      answer->ts[2 * i + 1] = read_over_bus(clock);
    }
    answer->ts[2 * answer->n_samples] = time_of(system);
    return 0;
  }
  int change(Clock& clock, const timex& request) {
    const bool is_system = &clock == &system;
    if ((request.modes & ADJ_TICK) != 0) {
      if (!is_system || request.tick < 9'000 || request.tick > 11'000) return EINVAL;
      clock.tick = request.tick;
    }
    if ((request.modes & ADJ_FREQUENCY) != 0) {
      const double ppb = static_cast<double>(request.freq) / 65.536;
      if (is_system && std::abs(ppb) > 500'000.0) return EINVAL;
      if (!is_system && std::abs(ppb) > static_cast<double>(max_adj_ppb)) return ERANGE;
      clock.freq = request.freq;
      clock.decide();
    }
    if ((request.modes & ADJ_SETOFFSET) != 0) {
      clock.time_ns += static_cast<double>(request.time.tv_sec) * 1e9 +
                       static_cast<double>(request.time.tv_usec);
    }
    if ((request.modes & ADJ_STATUS) != 0) clock.status = request.status;
    if ((request.modes & ADJ_TAI) != 0) clock.tai = static_cast<int>(request.constant);
    if ((request.modes & ADJ_MAXERROR) != 0) clock.maxerror = request.maxerror;
    if ((request.modes & ADJ_ESTERROR) != 0) clock.esterror = request.esterror;
    return 0;
  }

  std::map<int, std::string> holds_;
  int next_hold_ = 900;
};

}  // namespace ftcs::platform
