// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ftcs::ptp {

/// Reads big-endian integers (13.2: most significant octet first). What does not lie inside
/// entirely reads as zero, so that no input can make it read foreign memory; callers check lengths
/// first to give a good error.
class ByteReader {
 public:
  explicit constexpr ByteReader(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  /// kOctets of an unsigned integer, 1 to 8: six for the seconds of a Timestamp.
  template <class Integer, std::size_t kOctets = sizeof(Integer)>
  constexpr Integer read() noexcept {
    static_assert(kOctets <= sizeof(Integer));
    const std::uint64_t value =
        has(kOctets) ? join(bytes_.data() + offset_, std::make_index_sequence<kOctets>{}) : 0;
    offset_ += kOctets;
    return static_cast<Integer>(value);
  }
  template <std::size_t kOctets>
  constexpr std::array<std::uint8_t, kOctets> read_octets() noexcept {
    std::array<std::uint8_t, kOctets> octets{};
    if (has(kOctets)) {
      for (std::size_t i = 0; i < kOctets; ++i) octets[i] = bytes_[offset_ + i];
    }
    offset_ += kOctets;
    return octets;
  }
  constexpr void skip(std::size_t octets) noexcept { offset_ += octets; }
  [[nodiscard]] constexpr std::size_t offset() const noexcept { return offset_; }

 private:
  /// One expression instead of a loop: compilers make one load and a byte swap of it.
  template <std::size_t... kIndex>
  [[nodiscard]] static constexpr std::uint64_t join(const std::uint8_t* octets,
                                                    std::index_sequence<kIndex...>) noexcept {
    return ((std::uint64_t{octets[kIndex]} << (8 * (sizeof...(kIndex) - 1 - kIndex))) | ...);
  }
  [[nodiscard]] constexpr bool has(std::size_t octets) const noexcept {
    return offset_ <= bytes_.size() && octets <= bytes_.size() - offset_;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t offset_ = 0;
};

/// Writes big-endian integers; what does not fit is dropped, octet by octet.
class ByteWriter {
 public:
  explicit constexpr ByteWriter(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  /// The lowest kOctets octets of the value, 1 to 8.
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
