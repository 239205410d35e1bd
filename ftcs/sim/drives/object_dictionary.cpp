// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/object_dictionary.h"

#include <algorithm>
#include <cstring>

namespace ftcs::ethercat {

enum class Access : std::uint8_t {
  kRead,
  kWrite,
  kConfigure
};  // kConfigure: written in PREOP only

struct ObjectEntry {
  std::uint16_t index;
  std::uint8_t subindex;
  std::uint8_t size;  ///< bytes; 0: a string
  Access access;
  std::uint32_t reset_value;
};

namespace {

using enum Access;
constexpr std::uint32_t map_entry(ObjectAddress object, unsigned bits) {
  return (std::uint32_t{object.index} << 16) | (std::uint32_t{object.subindex} << 8) | bits;
}

/// Supported synchronisation types of 0x1C32:04: free run and SYNC0.
constexpr std::uint32_t kSupportedSync = 0x0005;
/// 250 us: the fastest cycle that the modelled drive takes.
constexpr std::uint32_t kMinCycle = 250000;

constexpr ObjectEntry kDriveEntries[] = {
    {0x1000, 0, 4, kRead, 0x00020192},  // CiA 402, servo drive
    {0x1001, 0, 1, kRead, 0},
    {0x1008, 0, 0, kRead, 0},
    {0x1009, 0, 0, kRead, 0},
    {0x100A, 0, 0, kRead, 0},
    {0x1018, 0, 1, kRead, 4},
    {0x1018, 1, 4, kRead, 0},
    {0x1018, 2, 4, kRead, 0},
    {0x1018, 3, 4, kRead, 0},
    {0x1018, 4, 4, kRead, 0},
    {0x10F1, 0, 1, kRead, 2},
    {0x10F1, 1, 4, kWrite, 0},
    {0x10F1, 2, 2, kWrite, 4},  // sync error counter limit
    {0x1600, 0, 1, kConfigure, 3},
    {0x1600, 1, 4, kConfigure, map_entry(obj::kControlword, 16)},
    {0x1600, 2, 4, kConfigure, map_entry(obj::kTargetPosition, 32)},
    {0x1600, 3, 4, kConfigure, map_entry(obj::kMode, 8)},
    {0x1600, 4, 4, kConfigure, 0},
    {0x1600, 5, 4, kConfigure, 0},
    {0x1600, 6, 4, kConfigure, 0},
    {0x1600, 7, 4, kConfigure, 0},
    {0x1600, 8, 4, kConfigure, 0},
    {0x1A00, 0, 1, kConfigure, 3},
    {0x1A00, 1, 4, kConfigure, map_entry(obj::kStatusword, 16)},
    {0x1A00, 2, 4, kConfigure, map_entry(obj::kPositionActual, 32)},
    {0x1A00, 3, 4, kConfigure, map_entry(obj::kModeDisplay, 8)},
    {0x1A00, 4, 4, kConfigure, 0},
    {0x1A00, 5, 4, kConfigure, 0},
    {0x1A00, 6, 4, kConfigure, 0},
    {0x1A00, 7, 4, kConfigure, 0},
    {0x1A00, 8, 4, kConfigure, 0},
    {0x1C00, 0, 1, kRead, 4},
    {0x1C00, 1, 1, kRead, 1},
    {0x1C00, 2, 1, kRead, 2},
    {0x1C00, 3, 1, kRead, 3},
    {0x1C00, 4, 1, kRead, 4},
    {0x1C12, 0, 1, kConfigure, 1},
    {0x1C12, 1, 2, kConfigure, obj::kReceiveMap},
    {0x1C13, 0, 1, kConfigure, 1},
    {0x1C13, 1, 2, kConfigure, obj::kTransmitMap},
    {0x1C32, 0, 1, kRead, 0x20},
    {0x1C32, 1, 2, kConfigure, 0},
    {0x1C32, 2, 4, kConfigure, 0},
    {0x1C32, 3, 4, kRead, 0},
    {0x1C32, 4, 2, kRead, kSupportedSync},
    {0x1C32, 5, 4, kRead, kMinCycle},
    {0x1C32, 6, 4, kRead, 20000},  // calculation and copy time
    {0x1C32, 9, 4, kRead, 0},
    {0x1C32, 10, 4, kRead, 0},
    {0x1C32, 11, 2, kRead, 0},
    {0x1C32, 12, 2, kRead, 0},
    {0x1C32, 32, 1, kRead, 0},
    {0x1C33, 0, 1, kRead, 0x20},
    {0x1C33, 1, 2, kConfigure, 0},
    {0x1C33, 2, 4, kConfigure, 0},
    {0x1C33, 3, 4, kRead, 0},
    {0x1C33, 4, 2, kRead, kSupportedSync},
    {0x1C33, 5, 4, kRead, kMinCycle},
    {0x1C33, 6, 4, kRead, 20000},
    {0x1C33, 9, 4, kRead, 0},
    {0x1C33, 10, 4, kRead, 0},
    {0x1C33, 11, 2, kRead, 0},
    {0x1C33, 12, 2, kRead, 0},
    {0x1C33, 32, 1, kRead, 0},
    {0x603F, 0, 2, kRead, 0},
    {0x6040, 0, 2, kWrite, 0},
    {0x6041, 0, 2, kRead, 0},
    {0x605A, 0, 2, kWrite, 2},
    {0x605B, 0, 2, kWrite, 1},
    {0x605C, 0, 2, kWrite, 1},
    {0x605D, 0, 2, kWrite, 1},
    {0x605E, 0, 2, kWrite, 2},
    {0x6060, 0, 1, kWrite, 0},
    {0x6061, 0, 1, kRead, 0},
    {0x6064, 0, 4, kRead, 0},
    {0x6065, 0, 4, kWrite, 100000},
    {0x606C, 0, 4, kRead, 0},
    {0x6071, 0, 2, kWrite, 0},
    {0x6077, 0, 2, kRead, 0},
    {0x607A, 0, 4, kWrite, 0},
    {0x60B0, 0, 4, kWrite, 0},
    {0x60B1, 0, 4, kWrite, 0},
    {0x60B2, 0, 2, kWrite, 0},
    {0x60C2, 0, 1, kRead, 2},
    {0x60C2, 1, 1, kWrite, 0},
    {0x60C2, 2, 1, kWrite, 0xFD},  // 10^-3 s
    {0x60F4, 0, 4, kRead, 0},
    {0x60FF, 0, 4, kWrite, 0},
    {0x6502, 0, 4, kRead, 0x80},  // cyclic synchronous position
};

constexpr ObjectEntry kBridgeEntries[] = {
    {0x1000, 0, 4, kRead, 0x00001389},  // ETG.5001, modular device
    {0x1008, 0, 0, kRead, 0},
    {0x1009, 0, 0, kRead, 0},
    {0x100A, 0, 0, kRead, 0},
    {0x1018, 0, 1, kRead, 4},
    {0x1018, 1, 4, kRead, 0},
    {0x1018, 2, 4, kRead, 0},
    {0x1018, 3, 4, kRead, 0},
    {0x1018, 4, 4, kRead, 0},
    {0x10F4, 0x00, 1, kRead, 0x13},
    {0x10F4, 0x01, 1, kRead, 0},
    {0x10F4, 0x0E, 1, kRead, 0},
    {0x10F4, 0x0F, 1, kRead, 0},
    {0x10F4, 0x10, 1, kRead, 1},
    {0x10F4, 0x11, 8, kRead, 0},
    {0x10F4, 0x12, 8, kRead, 0},
    {0x10F4, 0x13, 4, kRead, 0},
    {0x1A02, 0, 1, kRead, 9},
    {0x1A02, 1, 4, kRead, map_entry(obj::kSyncMode, 2)},
    {0x1A02, 2, 4, kRead, 6},
    {0x1A02, 3, 4, kRead, 5},
    {0x1A02, 4, 4, kRead, map_entry({0x10F4, 0x0E}, 1)},
    {0x1A02, 5, 4, kRead, map_entry(obj::kStampsUpdated, 1)},
    {0x1A02, 6, 4, kRead, map_entry(obj::kOtherSideMissing, 1)},
    {0x1A02, 7, 4, kRead, map_entry(obj::kInternalStamp, 64)},
    {0x1A02, 8, 4, kRead, map_entry(obj::kExternalStamp, 64)},
    {0x1A02, 9, 4, kRead, map_entry({0x10F4, 0x13}, 32)},
    {0x1C00, 0, 1, kRead, 4},
    {0x1C00, 1, 1, kRead, 1},
    {0x1C00, 2, 1, kRead, 2},
    {0x1C00, 3, 1, kRead, 3},
    {0x1C00, 4, 1, kRead, 4},
    {0x1C12, 0, 1, kConfigure, 0},
    {0x1C13, 0, 1, kConfigure, 0},
    {0x1C13, 1, 2, kConfigure, obj::kStampMap},
};
static_assert(std::size(kDriveEntries) <= ObjectDictionary::kCapacity);
static_assert(std::size(kBridgeEntries) <= ObjectDictionary::kCapacity);

/// They are searched by halves.
constexpr ObjectAddress address_of(const ObjectEntry& entry) {
  return {entry.index, entry.subindex};
}
static_assert(std::ranges::is_sorted(kDriveEntries, {}, address_of));
static_assert(std::ranges::is_sorted(kBridgeEntries, {}, address_of));
constexpr std::size_t kNotFound = ObjectDictionary::kCapacity;

constexpr std::size_t kMaxAssigned = 1;
constexpr std::uint32_t kMaxMapped = 8;  ///< that may be written
constexpr std::size_t kMostMapped = 9;   ///< that any map has

const char* text(std::uint16_t index, bool drive) noexcept {
  if (index != obj::kDeviceName) return "1.0";
  return drive ? "FTCS modelled servo drive" : "FTCS modelled bridge terminal";
}

/// At most eight octets, the lowest first.
std::uint64_t value_of(ConstBytes octets) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < octets.size(); ++i) value |= std::uint64_t{octets[i]} << (8 * i);
  return value;
}

ObjectAddress address_in(std::uint32_t mapped) noexcept {
  return {static_cast<std::uint16_t>(mapped >> 16), static_cast<std::uint8_t>(mapped >> 8)};
}
std::size_t bits_in(std::uint32_t mapped) noexcept { return mapped & 0xFFU; }
std::size_t bytes_in(std::uint32_t mapped) noexcept { return bits_in(mapped) / 8; }
/// Index 0 pads: nothing is behind it. Here in whole bytes.
bool is_gap(std::uint32_t mapped) noexcept {
  return address_in(mapped).index == 0 && (mapped & 0xFFU) > 0 && (mapped & 7U) == 0;
}

}  // namespace

ObjectDictionary::ObjectDictionary(const Identity& identity, DeviceKind kind) noexcept
    : identity_(identity),
      entries_(kind == DeviceKind::kDrive ? std::span<const ObjectEntry>{kDriveEntries}
                                          : std::span<const ObjectEntry>{kBridgeEntries}) {
  reset();
}

std::size_t ObjectDictionary::find(ObjectAddress object) const noexcept {
  const auto entry = std::ranges::lower_bound(entries_, object, {}, address_of);
  if (entry == entries_.end() || address_of(*entry) != object) return kNotFound;
  return static_cast<std::size_t>(entry - entries_.begin());
}

bool ObjectDictionary::has_index(std::uint16_t index) const noexcept {
  return std::any_of(entries_.begin(), entries_.end(),
                     [index](const ObjectEntry& entry) { return entry.index == index; });
}

void ObjectDictionary::reset() noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) values_[i] = entries_[i].reset_value;
  set({obj::kIdentity, 1}, identity_.vendor);
  set({obj::kIdentity, 2}, identity_.product);
  set({obj::kIdentity, 3}, identity_.revision);
  set({obj::kIdentity, 4}, identity_.serial);
}

std::uint32_t ObjectDictionary::get(ObjectAddress object) const noexcept {
  const std::size_t at = find(object);
  return at == kNotFound ? 0 : static_cast<std::uint32_t>(values_[at]);
}

void ObjectDictionary::set(ObjectAddress object, std::uint64_t value) noexcept {
  const std::size_t at = find(object);
  if (at != kNotFound) values_[at] = value;
}

SdoAbort ObjectDictionary::check_mapping(std::uint16_t map, std::uint32_t count) const noexcept {
  if (count > kMaxMapped) return SdoAbort::kMappingTooLong;
  for (std::uint32_t n = 1; n <= count; ++n) {
    const std::uint32_t mapped = get({map, static_cast<std::uint8_t>(n)});
    if (is_gap(mapped)) continue;
    const std::size_t at = find(address_in(mapped));
    if (at == kNotFound || entries_[at].size != bytes_in(mapped)) return SdoAbort::kCannotBeMapped;
  }
  return SdoAbort::kNone;
}

SdoAbort ObjectDictionary::download(ObjectAddress object, ConstBytes data, bool preop) noexcept {
  const std::size_t at = find(object);
  if (at == kNotFound) {
    return has_index(object.index) ? SdoAbort::kNoSuchSubindex : SdoAbort::kNoSuchObject;
  }
  const ObjectEntry& entry = entries_[at];
  if (entry.access == kRead) return SdoAbort::kReadOnly;
  if (entry.access == kConfigure && !preop) return SdoAbort::kWrongState;
  if (data.size() != entry.size) return SdoAbort::kLengthMismatch;
  const std::uint64_t value = value_of(data);
  const bool map = object.index == obj::kReceiveMap || object.index == obj::kTransmitMap;
  if (map && object.subindex == 0) {
    const SdoAbort abort = check_mapping(object.index, static_cast<std::uint32_t>(value));
    if (abort != SdoAbort::kNone) return abort;
  }
  const bool assignment =
      object.index == obj::kReceiveAssign || object.index == obj::kTransmitAssign;
  if (assignment && object.subindex == 0 && value > kMaxAssigned) {
    return SdoAbort::kMappingTooLong;
  }
  if (assignment && object.subindex == 1) {
    if (!can_be_assigned(object.index, value)) return SdoAbort::kValueOutOfRange;
  }
  values_[at] = value;
  return SdoAbort::kNone;
}

/// There is one map of each direction.
bool ObjectDictionary::can_be_assigned(std::uint16_t assignment, std::uint64_t map) const noexcept {
  if (assignment == obj::kReceiveAssign) return map == obj::kReceiveMap;
  return has_index(obj::kStampMap) ? map == obj::kStampMap : map == obj::kTransmitMap;
}

ObjectDictionary::Upload ObjectDictionary::upload(ObjectAddress object) const noexcept {
  Upload result;
  const std::size_t at = find(object);
  if (at == kNotFound) {
    result.abort = has_index(object.index) ? SdoAbort::kNoSuchSubindex : SdoAbort::kNoSuchObject;
    return result;
  }
  const ObjectEntry& entry = entries_[at];
  if (entry.size == 0) {
    const char* string = text(entry.index, !has_index(obj::kStampMap));
    result.size = std::min(std::strlen(string), result.bytes.size());
    std::memcpy(result.bytes.data(), string, result.size);
    return result;
  }
  result.size = entry.size;
  store(result.bytes, 0, values_[at]);
  return result;
}

std::uint32_t ObjectDictionary::mapping(std::uint16_t assignment, std::size_t n) const noexcept {
  if (get({assignment, 0}) == 0) return 0;
  const auto map = static_cast<std::uint16_t>(get({assignment, 1}));
  if (n >= get({map, 0})) return 0;
  return get({map, static_cast<std::uint8_t>(n + 1)});
}

std::size_t ObjectDictionary::mapped_bytes(std::uint16_t assignment) const noexcept {
  std::size_t bits = 0;
  for (std::size_t n = 0; n < kMostMapped; ++n) bits += bits_in(mapping(assignment, n));
  return (bits + 7) / 8;
}

void ObjectDictionary::write_mapped(ConstBytes outputs) noexcept {
  std::size_t at = 0;
  for (std::size_t n = 0; n < kMaxMapped; ++n) {
    const std::uint32_t mapped = mapping(obj::kReceiveAssign, n);
    const std::size_t size = bytes_in(mapped);
    if (at + size > outputs.size()) return;
    if (size > 0 && !is_gap(mapped)) set(address_in(mapped), value_of(outputs.subspan(at, size)));
    at += size;
  }
}

void ObjectDictionary::read_mapped(Bytes inputs) const noexcept {
  std::size_t at = 0;  // bits
  for (std::size_t n = 0; n < kMostMapped; ++n) {
    const std::uint32_t mapped = mapping(obj::kTransmitAssign, n);
    const std::size_t bits = bits_in(mapped);
    if (at + bits > inputs.size() * 8) return;
    const std::size_t entry = find(address_in(mapped));
    const std::uint64_t value = entry == kNotFound ? 0 : values_[entry];
    for (std::size_t i = 0; i < bits;) {
      const std::size_t shift = (at + i) % 8;
      const std::size_t part = std::min(8 - shift, bits - i);
      const unsigned mask = ((1U << part) - 1U) << shift;
      std::uint8_t& byte = inputs[(at + i) / 8];
      const auto here = static_cast<unsigned>(value >> i) << shift;
      byte = static_cast<std::uint8_t>((byte & ~mask) | (here & mask));
      i += part;
    }
    at += bits;
  }
}

}  // namespace ftcs::ethercat
