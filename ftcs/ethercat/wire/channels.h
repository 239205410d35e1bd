// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/wire/bytes.h"
#include "ftcs/ethercat/wire/registers.h"

namespace ftcs::ethercat {

/// One channel of the fieldbus memory management unit: it lets a piece of memory appear at a
/// logical address, bit by bit (ETG.1000.4, 6.6). Logical bits run from logical_start * 8 +
/// start_bit to (logical_start + length - 1) * 8 + stop_bit.
struct FmmuChannel {
  std::uint32_t logical_start = 0;   ///< octets in the logical address space of 4 GiByte
  std::uint16_t length = 0;          ///< octets that are touched, the first and last one included
  std::uint8_t start_bit = 0;        ///< of the first octet, 0 to 7
  std::uint8_t stop_bit = 7;         ///< of the last octet, 0 to 7
  std::uint16_t physical_start = 0;  ///< in the memory of the controller
  std::uint8_t physical_bit = 0;
  bool read = false;   ///< inputs
  bool write = false;  ///< outputs
  bool active = false;

  /// bytes.size() must be at least reg::kFmmuSize.
  [[nodiscard]] static constexpr FmmuChannel decode(ConstBytes bytes) noexcept {
    constexpr std::uint8_t kBit = 0x07;
    return {load<std::uint32_t>(bytes, 0),
            load<std::uint16_t>(bytes, 4),
            static_cast<std::uint8_t>(bytes[6] & kBit),
            static_cast<std::uint8_t>(bytes[7] & kBit),
            load<std::uint16_t>(bytes, 8),
            static_cast<std::uint8_t>(bytes[10] & kBit),
            (bytes[11] & 1U) != 0,
            (bytes[11] & 2U) != 0,
            (bytes[12] & 1U) != 0};
  }
  /// bytes.size() must be at least reg::kFmmuSize.
  constexpr void encode(Bytes bytes) const noexcept {
    store(bytes, 0, logical_start);
    store(bytes, 4, length);
    bytes[6] = start_bit;
    bytes[7] = stop_bit;
    store(bytes, 8, physical_start);
    bytes[10] = physical_bit;
    bytes[11] = static_cast<std::uint8_t>((read ? 1U : 0U) | (write ? 2U : 0U));
    bytes[12] = active ? 1 : 0;
  }
};

/// One sync manager: it makes a piece of memory consistent between the wire and the application
/// (ETG.1000.4, 6.7). Status and the application's control byte are not part of the configuration.
struct SyncManagerChannel {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  bool active = false;

  static constexpr std::uint8_t kMailboxMode = 0x02;  ///< one buffer, handshake; else three buffers
  static constexpr std::uint8_t kMainDeviceWrites = 0x04;
  static constexpr std::uint8_t kWatchdog = 0x40;
  static constexpr std::uint8_t kMailboxFull = 0x08;  ///< in the status byte

  [[nodiscard]] constexpr bool mailbox() const noexcept { return (control & 0x03) == kMailboxMode; }
  [[nodiscard]] constexpr bool main_device_writes() const noexcept {
    return (control & 0x0C) == kMainDeviceWrites;
  }
  [[nodiscard]] constexpr bool watchdog() const noexcept { return (control & kWatchdog) != 0; }

  /// bytes.size() must be at least reg::kSyncManagerSize.
  [[nodiscard]] static constexpr SyncManagerChannel decode(ConstBytes bytes) noexcept {
    return {load<std::uint16_t>(bytes, 0), load<std::uint16_t>(bytes, 2), bytes[4],
            (bytes[6] & 1U) != 0};
  }
  /// bytes.size() must be at least reg::kSyncManagerSize.
  constexpr void encode(Bytes bytes) const noexcept {
    store(bytes, 0, start);
    store(bytes, 2, length);
    bytes[4] = control;
    bytes[6] = active ? 1 : 0;
  }
};

/// DL status (0x0110): link and loop of each port (ETG.1000.4, 6.1.3).
struct DlStatus {
  std::uint16_t bits = 0;

  /// There is a physical link at this port, 0 to 3.
  [[nodiscard]] constexpr bool link(unsigned port) const noexcept {
    return ((bits >> (4 + port)) & 1U) != 0;
  }
  [[nodiscard]] constexpr bool loop_closed(unsigned port) const noexcept {
    return ((bits >> (8 + 2 * port)) & 1U) != 0;
  }
  /// A frame really leaves and comes back here.
  [[nodiscard]] constexpr bool communication(unsigned port) const noexcept {
    return ((bits >> (9 + 2 * port)) & 1U) != 0;
  }
  /// The frame visits what hangs on this port.
  [[nodiscard]] constexpr bool open(unsigned port) const noexcept {
    return communication(port) && !loop_closed(port);
  }
  constexpr void set(unsigned port, bool open) noexcept {
    const unsigned clear = (1U << (4 + port)) | (3U << (8 + 2 * port));
    const unsigned state =
        open ? (1U << (4 + port)) | (2U << (8 + 2 * port)) : 1U << (8 + 2 * port);
    bits = static_cast<std::uint16_t>((bits & ~clear) | state);
  }
};

/// A frame visits the ports of a SubDevice in this order (ETG.1000.4, 6.1).
inline constexpr std::uint8_t kPortOrder[reg::kPorts] = {0, 3, 1, 2};

}  // namespace ftcs::ethercat
