// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/platform/os_error.h"
#include "ftcs/time/duration.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// What a reference clock tells an NTP program about the system clock, at one instant.
struct NtpSample {
  std::int64_t system_ns = 0;  ///< CLOCK_REALTIME
  Duration behind{};           ///< reference minus system clock, both UTC: positive, it is behind
  int leap = 0;                ///< at the end of this UTC day: +1, -1, 0 none
  double sigma_s = 0.0;        ///< standard deviation of `behind`
};

/// The largest power of two of seconds that NTP calls the precision of such a sample: ceil(log2
/// sigma), not below 2^-30 s (a nanosecond).
[[nodiscard]] int ntp_precision(double sigma_s) noexcept;

/// chrony's SOCK reference clock (chrony.conf(5), "refclock SOCK"): one datagram of 40 octets a
/// sample. It has no field for the uncertainty: `precision` of the directive says it.
class ChronySocket {
 public:
  static constexpr std::size_t kSize = 40;
  [[nodiscard]] static Result<ChronySocket, OsError> open(std::string path);
  ChronySocket(ChronySocket&& other) noexcept;
  ChronySocket& operator=(ChronySocket&&) = delete;
  ChronySocket(const ChronySocket&) = delete;
  ~ChronySocket();

  /// chronyd may come later or again: an error is no reason to stop.
  std::optional<OsError> send(const NtpSample& sample);
  /// The datagram: timeval, offset in seconds, pulse 0, leap (0, 1 insert, 2 delete), padding,
  /// "SOCK".
  [[nodiscard]] static std::array<std::uint8_t, kSize> encode(const NtpSample& sample) noexcept;

 private:
  ChronySocket(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  int fd_;
  std::string path_;
};

/// The shared-memory reference clock of ntpd, chrony and gpsd, System V segment 0x4e545030 + unit,
/// mode 1: a counter on both sides of a write, so that a reader notices one in progress. Leap as
/// above; precision from sigma.
class NtpShm {
 public:
  static constexpr int kUnits = 256;
  /// Made if it is not there: units 0 and 1 for the owner alone, others for everybody, as ntpd
  /// does.
  [[nodiscard]] static Result<NtpShm, OsError> open(int unit);
  NtpShm(NtpShm&& other) noexcept;
  NtpShm& operator=(NtpShm&&) = delete;
  NtpShm(const NtpShm&) = delete;
  ~NtpShm();

  void write(const NtpSample& sample) noexcept;

 private:
  struct Segment;
  explicit NtpShm(Segment* segment) : segment_(segment) {}
  Segment* segment_;
};

}  // namespace ftcs::platform
