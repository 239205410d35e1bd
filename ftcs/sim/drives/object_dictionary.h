// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "ftcs/ethercat/wire/mailbox.h"
#include "ftcs/ethercat/wire/sii.h"

namespace ftcs::ethercat {

/// Objects of a CiA 402 drive (names in object_dictionary.cpp).
namespace obj {
inline constexpr std::uint16_t kDeviceName = 0x1008;
inline constexpr std::uint16_t kIdentity = 0x1018;
inline constexpr ObjectAddress kSyncErrorLimit{0x10F1, 2};
inline constexpr std::uint16_t kReceiveMap = 0x1600;
inline constexpr std::uint16_t kTransmitMap = 0x1A00;
inline constexpr std::uint16_t kReceiveAssign = 0x1C12;
inline constexpr std::uint16_t kTransmitAssign = 0x1C13;
inline constexpr std::uint16_t kOutputSync = 0x1C32;
inline constexpr std::uint16_t kInputSync = 0x1C33;
inline constexpr ObjectAddress kSyncType{kOutputSync, 1};
inline constexpr ObjectAddress kSyncCycle{kOutputSync, 2};
inline constexpr ObjectAddress kSyncMinCycle{kOutputSync, 5};
inline constexpr ObjectAddress kSync0Cycle{kOutputSync, 0x0A};
inline constexpr ObjectAddress kEventMissed{kOutputSync, 0x0B};
inline constexpr ObjectAddress kSyncError{kOutputSync, 0x20};
inline constexpr ObjectAddress kErrorCode{0x603F, 0};
inline constexpr ObjectAddress kControlword{0x6040, 0};
inline constexpr ObjectAddress kStatusword{0x6041, 0};
inline constexpr ObjectAddress kMode{0x6060, 0};
inline constexpr ObjectAddress kModeDisplay{0x6061, 0};
inline constexpr ObjectAddress kPositionActual{0x6064, 0};
inline constexpr ObjectAddress kVelocityActual{0x606C, 0};
inline constexpr ObjectAddress kTargetPosition{0x607A, 0};
inline constexpr ObjectAddress kInterpolationPeriod{0x60C2, 1};
inline constexpr ObjectAddress kInterpolationIndex{0x60C2, 2};
inline constexpr ObjectAddress kFollowingError{0x60F4, 0};
/// External synchronization of a bridge terminal.
inline constexpr ObjectAddress kSyncMode{0x10F4, 0x01};
inline constexpr ObjectAddress kStampsUpdated{0x10F4, 0x0F};
inline constexpr ObjectAddress kOtherSideMissing{0x10F4, 0x10};
inline constexpr ObjectAddress kInternalStamp{0x10F4, 0x11};
inline constexpr ObjectAddress kExternalStamp{0x10F4, 0x12};
inline constexpr std::uint16_t kStampMap = 0x1A02;
/// 0x1C32:01 = 2: synchronous to SYNC0.
inline constexpr std::uint32_t kSyncTypeSync0 = 2;
}  // namespace obj

/// What a modelled SubDevice is.
enum class DeviceKind : std::uint8_t {
  kDrive,   ///< a CiA 402 servo drive
  kBridge,  ///< a bridge terminal: it joins two segments and shows the clocks of both
};

struct ObjectEntry;

/// The object dictionary of a modelled SubDevice: numbers up to eight bytes, and three strings.
class ObjectDictionary {
 public:
  static constexpr std::size_t kCapacity = 144;

  explicit ObjectDictionary(const Identity& identity,
                            DeviceKind kind = DeviceKind::kDrive) noexcept;
  void reset() noexcept;

  /// Access of the MainDevice: rights, size and state are checked.
  [[nodiscard]] SdoAbort download(ObjectAddress object, ConstBytes data, bool preop) noexcept;
  struct Upload {
    SdoAbort abort = SdoAbort::kNone;
    std::array<std::uint8_t, 32> bytes{};
    std::size_t size = 0;
  };
  [[nodiscard]] Upload upload(ObjectAddress object) const noexcept;

  /// Access of the drive itself. An object that does not exist reads zero.
  [[nodiscard]] std::uint32_t get(ObjectAddress object) const noexcept;
  [[nodiscard]] std::int32_t get_signed(ObjectAddress object) const noexcept {
    return static_cast<std::int32_t>(get(object));
  }
  void set(ObjectAddress object, std::uint64_t value) noexcept;

  /// Bytes of the process data that an assignment (0x1C12, 0x1C13) maps.
  [[nodiscard]] std::size_t mapped_bytes(std::uint16_t assignment) const noexcept;
  /// Copies outputs into the mapped objects, or the mapped objects into inputs.
  void write_mapped(ConstBytes outputs) noexcept;
  void read_mapped(Bytes inputs) const noexcept;

 private:
  [[nodiscard]] std::size_t find(ObjectAddress object) const noexcept;
  [[nodiscard]] bool has_index(std::uint16_t index) const noexcept;
  [[nodiscard]] bool can_be_assigned(std::uint16_t assignment, std::uint64_t map) const noexcept;
  [[nodiscard]] SdoAbort check_mapping(std::uint16_t map, std::uint32_t count) const noexcept;
  /// The n-th mapped object of an assignment (mapping entry: index 16, subindex 8, bits 8).
  [[nodiscard]] std::uint32_t mapping(std::uint16_t assignment, std::size_t n) const noexcept;

  Identity identity_;
  std::span<const ObjectEntry> entries_;
  std::array<std::uint64_t, kCapacity> values_{};
};

}  // namespace ftcs::ethercat
