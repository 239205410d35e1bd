// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/wire/bytes.h"

namespace ftcs::ethercat {

/// Commands of a datagram (ETG.1000.4, 5.4). First letters: auto-increment, configured (fixed)
/// address, broadcast, logical; M: one SubDevice is read and all others are written.
///
/// Each SubDevice that is meant and can do it adds to the working counter: 1 for a read, 1 for a
/// write, 3 for both (a read 1, a write 2). Broadcast reads OR what they find into the data.
enum class Command : std::uint8_t {
  kNop = 0,    ///< passes by
  kAprd = 1,   ///< read by position
  kApwr = 2,   ///< write by position
  kAprw = 3,   ///< both: first read, then written
  kFprd = 4,   ///< read by station address (0x0010)
  kFpwr = 5,   ///< write by station address
  kFprw = 6,   ///< both
  kBrd = 7,    ///< read of all, OR-ed
  kBwr = 8,    ///< write to all
  kBrw = 9,    ///< both
  kLrd = 10,   ///< read of the process image, through FMMUs
  kLwr = 11,   ///< write to it
  kLrw = 12,   ///< both: the cycle's process data
  kArmw = 13,  ///< read at the position, written by all others
  kFrmw = 14,  ///< the same by station address: how the reference's 0x0910 is given to all
};
inline constexpr std::uint8_t kLastCommand = 14;

/// What `position` and `offset` of a datagram mean.
enum class Addressing : std::uint8_t { kNone, kAutoIncrement, kConfigured, kBroadcast, kLogical };

[[nodiscard]] constexpr Addressing addressing(Command command) noexcept {
  switch (command) {
    case Command::kAprd:
    case Command::kApwr:
    case Command::kAprw:
    case Command::kArmw:
      return Addressing::kAutoIncrement;
    case Command::kFprd:
    case Command::kFpwr:
    case Command::kFprw:
    case Command::kFrmw:
      return Addressing::kConfigured;
    case Command::kBrd:
    case Command::kBwr:
    case Command::kBrw:
      return Addressing::kBroadcast;
    case Command::kLrd:
    case Command::kLwr:
    case Command::kLrw:
      return Addressing::kLogical;
    case Command::kNop:
      break;
  }
  return Addressing::kNone;
}

/// Where a datagram goes: ADP and ADO, or one logical address of 32 bits in their place.
struct Target {
  Command command = Command::kNop;
  std::uint16_t position = 0;  ///< ADP: position (counted up on the way) or station address
  std::uint16_t offset = 0;    ///< ADO: address in the memory of the SubDevice

  /// Auto-increment: the SubDevice that receives zero is meant, so that the n-th is sent -n.
  [[nodiscard]] static constexpr Target at_position(Command command, std::size_t n,
                                                    std::uint16_t offset) noexcept {
    return {command, static_cast<std::uint16_t>(0U - n), offset};
  }
  [[nodiscard]] static constexpr Target logical(Command command, std::uint32_t address) noexcept {
    return {command, static_cast<std::uint16_t>(address),
            static_cast<std::uint16_t>(address >> 16)};
  }
};

inline constexpr std::size_t kDatagramHeaderSize = 10;
inline constexpr std::size_t kWorkingCounterSize = 2;
inline constexpr std::size_t kDatagramOverhead = kDatagramHeaderSize + kWorkingCounterSize;
// Of the field of length and flags (5.3).
inline constexpr std::uint16_t kLengthMask = 0x07FF;       ///< octets of data
inline constexpr std::uint16_t kCirculatingFlag = 0x4000;  ///< has passed a closed loop once
inline constexpr std::uint16_t kMoreFollowsFlag = 0x8000;  ///< another datagram in this frame

/// One datagram inside a frame whose structure FrameView has checked (ETG.1000.4, 5.3):
/// command 1, index 1, address 4, length and flags 2, event field 2, data, working counter 2.
class Datagram {
 public:
  constexpr explicit Datagram(Bytes bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] constexpr Command command() const noexcept {
    return static_cast<Command>(bytes_[0]);
  }
  [[nodiscard]] constexpr std::uint8_t index() const noexcept { return bytes_[1]; }
  [[nodiscard]] constexpr std::uint16_t position() const noexcept {
    return load<std::uint16_t>(bytes_, 2);
  }
  [[nodiscard]] constexpr std::uint16_t offset() const noexcept {
    return load<std::uint16_t>(bytes_, 4);
  }
  [[nodiscard]] constexpr std::uint32_t logical_address() const noexcept {
    return load<std::uint32_t>(bytes_, 2);
  }
  [[nodiscard]] constexpr bool circulating() const noexcept {
    return (load<std::uint16_t>(bytes_, 6) & kCirculatingFlag) != 0;
  }
  /// Events of all SubDevices that were passed, OR-ed (0x0210, as far as 0x0200 lets them).
  [[nodiscard]] constexpr std::uint16_t event() const noexcept {
    return load<std::uint16_t>(bytes_, 8);
  }
  [[nodiscard]] constexpr Bytes data() const noexcept {
    return bytes_.subspan(kDatagramHeaderSize, bytes_.size() - kDatagramOverhead);
  }
  /// Zero when it is sent; see Command for what is added on the way.
  [[nodiscard]] constexpr std::uint16_t working_counter() const noexcept {
    return load<std::uint16_t>(bytes_, bytes_.size() - kWorkingCounterSize);
  }

  // What a SubDevice, or who numbers frames, does to a datagram on its way.
  constexpr void set_index(std::uint8_t index) const noexcept { bytes_[1] = index; }
  constexpr void set_position(std::uint16_t position) const noexcept { store(bytes_, 2, position); }
  constexpr void add_event(std::uint16_t event) const noexcept {
    store(bytes_, 8, static_cast<std::uint16_t>(this->event() | event));
  }
  constexpr void add_to_working_counter(unsigned increment) const noexcept {
    store(bytes_, bytes_.size() - kWorkingCounterSize,
          static_cast<std::uint16_t>(working_counter() + increment));
  }

 private:
  Bytes bytes_;
};

}  // namespace ftcs::ethercat
