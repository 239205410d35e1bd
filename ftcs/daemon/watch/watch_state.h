// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>

#include "ftcs/diagnosis/finding.h"

namespace ftcs::daemon {

/// Characters without a heap; what is too long is cut.
template <std::size_t Size>
struct WatchText {
  std::array<char, Size> characters{};
  std::uint16_t size = 0;

  void set(std::string_view text) noexcept {
    size = static_cast<std::uint16_t>(std::min(text.size(), Size));
    std::copy_n(text.begin(), size, characters.begin());
  }
  [[nodiscard]] std::string_view view() const noexcept { return {characters.data(), size}; }
};

/// What a clock or a cycle is doing, as operators call it.
enum class WatchMode : std::uint8_t { kFreeRun, kAcquiring, kLocked, kHoldover };
inline constexpr std::size_t kWatchModes = 4;
/// "freerun", "acquiring", "locked", "holdover".
[[nodiscard]] std::string_view name(WatchMode mode) noexcept;

/// One measurement. Not known: not a number.
struct WatchPoint {
  double time_s = 0.0;  ///< since the start
  double offset_ns = 0.0;
  double sigma_ns = 0.0;
  double rate_ppb = 0.0;
  double delay_ns = 0.0;
  bool used = true;
  bool locked = true;  ///< figures of stability are of such points alone
};

struct WatchedDrive {
  std::uint8_t state = 0;  ///< AL state (ETG.1000.6, 0x0130)
  float margin_us = 0.0F;  ///< SYNC0 minus arrival of the frame
};

/// Of an EtherCAT MainDevice. Times in ns.
struct WatchedCycle {
  static constexpr std::size_t kDrives = 64;
  bool present = false;
  double phase_ns = 0.0;
  double margin_ns = 0.0;
  std::uint16_t working_counter = 0;
  std::uint16_t expected_counter = 0;
  std::uint16_t axes_in_fault = 0;
  std::uint64_t lost = 0;
  std::uint64_t late = 0;
  std::uint16_t drives = 0;
  std::array<WatchedDrive, kDrives> drive{};
};

/// Of a port with keys (16.14): how many messages were authentic, and why others were dropped.
struct WatchedMessages {
  bool present = false;
  std::uint64_t authentic = 0;
  std::uint64_t missing = 0;
  std::uint64_t unknown_key = 0;
  std::uint64_t wrong_code = 0;
  std::uint64_t unsupported = 0;
  std::uint64_t replayed = 0;
};

/// What is known now. A plain value: the loop copies it for those who watch.
struct WatchState {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  WatchText<16> kind{};    ///< "ptp", "phc", "ethercat"
  WatchText<64> target{};  ///< the interface, or the steered clock
  WatchText<32> servo{};
  WatchText<64> reference{};  ///< the grandmaster, or the clock that is followed
  WatchMode mode = WatchMode::kFreeRun;
  diagnosis::Cause cause = diagnosis::Cause::kAcquiring;
  WatchText<600> sentence{};
  double uptime_s = 0.0;
  double offset_ns = kUnknown;
  double sigma_ns = kUnknown;
  double rate_ppb = kUnknown;
  double delay_ns = kUnknown;
  std::uint64_t used = 0;
  std::uint64_t outliers = 0;
  std::uint64_t duplicates = 0;
  std::uint64_t implausible = 0;
  std::uint64_t steps = 0;
  std::uint64_t holdovers = 0;
  WatchedMessages messages{};
  WatchedCycle cycle{};
};
static_assert(std::is_trivially_copyable_v<WatchState> && std::is_trivially_copyable_v<WatchPoint>);

/// The offset while it is measured; in holdover nobody measures it, and only the bound is known.
[[nodiscard]] double measured_offset_ns(const WatchState& state) noexcept;
/// An offset of so much cannot be exceeded while the reference is right: |offset| + 3 sigma + the
/// path delay, as no asymmetry of the path is larger.
[[nodiscard]] double offset_bound_ns(const WatchState& state) noexcept;

}  // namespace ftcs::daemon
