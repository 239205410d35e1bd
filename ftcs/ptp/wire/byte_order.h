// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ftcs::ptp {

/// Reads big-endian integers (13.2: most significant octet first). Beyond the end it yields zeros,
/// so that no input can make it read foreign memory; callers check lengths first to give a good
/// error.
class ByteReader {
 public:
  explicit constexpr ByteReader(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <class Integer, std::size_t kOctets = sizeof(Integer)>
  constexpr Integer read() noexcept {
    static_assert(kOctets <= sizeof(Integer));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < kOctets; ++i) {
      value = (value << 8) | (offset_ < bytes_.size() ? bytes_[offset_] : 0U);
      ++offset_;
    }
    return static_cast<Integer>(value);
  }
  constexpr void skip(std::size_t octets) noexcept { offset_ += octets; }
  [[nodiscard]] constexpr std::size_t offset() const noexcept { return offset_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t offset_ = 0;
};

/// Writes big-endian integers; what does not fit is dropped.
class ByteWriter {
 public:
  explicit constexpr ByteWriter(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <std::size_t kOctets>
  constexpr void write(std::uint64_t value) noexcept {
    static_assert(kOctets <= sizeof(value));
    for (std::size_t i = kOctets; i-- > 0;) {
      if (offset_ < bytes_.size()) bytes_[offset_] = static_cast<std::uint8_t>(value >> (8 * i));
      ++offset_;
    }
  }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t offset_ = 0;
};

}  // namespace ftcs::ptp
