// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/sdo_client.h"
#include "ftcs/ethercat/wire/bytes.h"

namespace ftcs::ethercat {

/// A bridge terminal joins two segments and shows to each the distributed clocks of both, latched
/// at the same instant: object 0x10F4, external synchronization, mapped by the TxPDO 0x1A02 (time
/// stamps of 64 bits). Beckhoff's EL6692 and EL6695 are such (their documentation, "Terminal-
/// specific CoE objects"); the terminal has a system time of its own, and no SYNC signals.
namespace bridge {

inline constexpr std::uint16_t kTimeStamps = 0x1A02;  ///< TxPDO
inline constexpr std::size_t kInputSize = 22;         ///< octets of it

/// Of 0x1C12 and 0x1C13: no outputs, the time stamps as inputs.
inline constexpr std::array<SdoDownload, 4> kObjects{{
    {{0x1C12, 0}, 1, 0, false},
    {{0x1C13, 0}, 1, 0},
    {{0x1C13, 1}, 2, kTimeStamps},
    {{0x1C13, 0}, 1, 1},
}};

/// The terminal's process data.
struct Inputs {
  bool updated = false;    ///< 0x10F4:0F, toggles with each new pair of stamps
  bool alone = false;      ///< 0x10F4:10, the other side is not connected to its segment
  std::uint64_t internal;  ///< 0x10F4:11, system time of this segment, ns
  std::uint64_t external;  ///< 0x10F4:12, system time of the other segment at the same instant, ns

  /// bytes.size() must be at least kInputSize.
  [[nodiscard]] static Inputs decode(ConstBytes bytes) noexcept {
    constexpr unsigned kUpdated = 0x40;
    constexpr unsigned kAlone = 0x80;
    return {(bytes[1] & kUpdated) != 0, (bytes[1] & kAlone) != 0, load<std::uint64_t>(bytes, 2),
            load<std::uint64_t>(bytes, 10)};
  }
};

/// The first SubDevice that is known as a bridge terminal.
inline constexpr std::size_t kFirst = kMaxSubDevices;

/// Notes in the network which SubDevice is asked for the stamps: the one at the position `wanted`,
/// or kFirst. False: there is none that can be, with CoE and a clock of 64 bits.
[[nodiscard]] bool choose(Network& network, std::size_t wanted) noexcept;

}  // namespace bridge
}  // namespace ftcs::ethercat
