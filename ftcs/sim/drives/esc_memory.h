// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/wire/bytes.h"
#include "ftcs/ethercat/wire/channels.h"
#include "ftcs/ethercat/wire/registers.h"

namespace ftcs::ethercat {

/// Registers (0x0000 to 0x0FFF) and process data memory (8 KiByte from 0x1000) of a SubDevice
/// controller.
class EscMemory {
 public:
  static constexpr std::size_t kRamKiByte = 8;
  static constexpr std::size_t kSize = reg::kProcessRam + kRamKiByte * 1024;
  static constexpr std::size_t kFmmus = 8;
  static constexpr std::size_t kSyncManagers = 8;

  template <std::unsigned_integral T>
  [[nodiscard]] T get(std::size_t address) const noexcept {
    return load<T>(bytes_, address);
  }
  template <std::unsigned_integral T>
  void set(std::size_t address, T value) noexcept {
    store(bytes_, address, value);
  }
  [[nodiscard]] Bytes bytes() noexcept { return bytes_; }
  [[nodiscard]] ConstBytes bytes() const noexcept { return bytes_; }
  [[nodiscard]] static constexpr bool contains(std::size_t address, std::size_t size) noexcept {
    return address + size <= kSize;
  }
  void clear() noexcept { bytes_.fill(0); }

  [[nodiscard]] SyncManagerChannel sync_manager(std::size_t n) const noexcept {
    return SyncManagerChannel::decode(ConstBytes{bytes_}.subspan(
        reg::kSyncManager + n * reg::kSyncManagerSize, reg::kSyncManagerSize));
  }
  [[nodiscard]] bool mailbox_full(std::size_t n) const noexcept {
    return (bytes_[status_of(n)] & SyncManagerChannel::kMailboxFull) != 0;
  }
  void set_mailbox_full(std::size_t n, bool full) noexcept {
    const unsigned others = bytes_[status_of(n)] & ~unsigned{SyncManagerChannel::kMailboxFull};
    bytes_[status_of(n)] =
        static_cast<std::uint8_t>(others | (full ? SyncManagerChannel::kMailboxFull : 0U));
  }
  /// The memory of a sync manager; empty if it reaches out of the memory.
  [[nodiscard]] Bytes window(const SyncManagerChannel& channel) noexcept {
    if (!contains(channel.start, channel.length)) return {};
    return Bytes{bytes_}.subspan(channel.start, channel.length);
  }

 private:
  [[nodiscard]] static constexpr std::size_t status_of(std::size_t n) noexcept {
    constexpr std::size_t kStatusAt = 5;
    return reg::kSyncManager + n * reg::kSyncManagerSize + kStatusAt;
  }
  std::array<std::uint8_t, kSize> bytes_{};
};

}  // namespace ftcs::ethercat
