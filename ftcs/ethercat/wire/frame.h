// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/wire/datagram.h"
#include "ftcs/time/result.h"

namespace ftcs::ethercat {

/// Why octets are no EtherCAT frame, or one cannot be written.
enum class FrameError : std::uint8_t {
  kTooShort,           ///< not even a header
  kForeign,            ///< an Ethernet frame of another EtherType
  kNotDatagrams,       ///< EtherCAT, but not type 1 (network variables, mailbox gateway)
  kLengthBeyondFrame,  ///< the header promises more bytes than came
  kDatagramTruncated,  ///< a datagram reaches beyond the length of the header
  kUnknownCommand,     ///< a command that ETG.1000.4 does not know
  kNoRoom,             ///< encoding: the buffer or the length field is too small
};
[[nodiscard]] const char* name(FrameError error) noexcept;

inline constexpr std::size_t kFrameHeaderSize = 2;
/// Ethernet payload of 1500 bytes: what one frame can carry, frame header included.
inline constexpr std::size_t kMaxFrameSize = 1500;
inline constexpr std::size_t kEthernetHeaderSize = 14;
/// Without the checksum; shorter frames are padded (IEEE 802.3).
inline constexpr std::size_t kMinEthernetSize = 60;
inline constexpr std::size_t kMaxEthernetSize = kEthernetHeaderSize + kMaxFrameSize;
inline constexpr std::uint16_t kEtherType = 0x88A4;
/// The same number serves the UDP encapsulation as port (ETG.1000.4, 5.2.3), where the UDP payload
/// is the frame from its EtherCAT header on.
inline constexpr std::uint16_t kUdpPort = 0x88A4;

/// An EtherCAT frame (header of 2 bytes and datagrams) whose structure has been checked as a whole:
/// iterating it needs no further checks. Trailing bytes are padding. It refers to the caller's
/// bytes.
///
///     if (const auto frame = FrameView::parse(octets))
///       for (const Datagram datagram : *frame) use(datagram.command(), datagram.data());
class FrameView {
 public:
  /// From the EtherCAT header on (ETG.1000.4, 5.3). Whole or not at all.
  [[nodiscard]] static Result<FrameView, FrameError> parse(Bytes frame) noexcept;

  class Iterator {
   public:
    constexpr Iterator(Bytes rest) noexcept : rest_(rest) {}
    [[nodiscard]] constexpr Datagram operator*() const noexcept {
      return Datagram{rest_.first(size())};
    }
    constexpr Iterator& operator++() noexcept {
      rest_ = rest_.subspan(size());
      return *this;
    }
    friend constexpr bool operator!=(const Iterator& a, const Iterator& b) noexcept {
      return a.rest_.size() != b.rest_.size();
    }

    [[nodiscard]] constexpr Bytes rest() const noexcept { return rest_; }

   private:
    [[nodiscard]] constexpr std::size_t size() const noexcept {
      return kDatagramOverhead + (load<std::uint16_t>(rest_, 6) & kLengthMask);
    }
    Bytes rest_;
  };
  [[nodiscard]] constexpr Iterator begin() const noexcept { return {datagrams_}; }
  [[nodiscard]] constexpr Iterator end() const noexcept { return {datagrams_.last(0)}; }
  [[nodiscard]] constexpr std::size_t count() const noexcept { return count_; }
  /// The n-th datagram; n < count().
  [[nodiscard]] constexpr Datagram operator[](std::size_t n) const noexcept {
    Iterator it = begin();
    for (; n > 0; --n) ++it;
    return *it;
  }
  /// The n-th datagram and those behind it; n <= count().
  [[nodiscard]] constexpr FrameView from(std::size_t n) const noexcept {
    Iterator it = begin();
    for (std::size_t i = 0; i < n; ++i) ++it;
    return {it.rest(), count_ - n};
  }

 private:
  constexpr FrameView(Bytes datagrams, std::size_t count) noexcept
      : datagrams_(datagrams), count_(count) {}
  Bytes datagrams_;
  std::size_t count_;
};

/// Writes datagrams one after another into the caller's buffer. After an overflow it stays full:
/// check once, at finish().
class FrameWriter {
 public:
  /// All datagrams of a frame carry one index: a reply is recognised by it.
  constexpr FrameWriter(Bytes buffer, std::uint8_t index) noexcept
      : buffer_(buffer), index_(index) {}

  /// Appends a datagram with `size` data bytes of zero. Returns its data (empty if it did not fit).
  Bytes add(const Target& target, std::size_t size) noexcept;
  /// Appends a datagram with these data.
  Bytes add(const Target& target, ConstBytes data) noexcept;
  /// Appends a datagram with one little-endian value.
  template <std::unsigned_integral T>
  Bytes add_value(const Target& target, T value) noexcept {
    const Bytes data = add(target, sizeof(T));
    if (!data.empty()) store(data, 0, value);
    return data;
  }
  /// Bytes that are left, overhead of the next datagram included.
  [[nodiscard]] constexpr std::size_t room() const noexcept {
    const std::size_t limit = buffer_.size() < kMaxFrameSize ? buffer_.size() : kMaxFrameSize;
    return overflow_ ? 0 : limit - used_;
  }
  [[nodiscard]] constexpr bool empty() const noexcept { return last_ == 0; }
  [[nodiscard]] constexpr std::uint8_t index() const noexcept { return index_; }
  /// Writes the header; the finished frame.
  [[nodiscard]] Result<ConstBytes, FrameError> finish() noexcept;

 private:
  Bytes buffer_;
  std::size_t used_ = kFrameHeaderSize;
  std::size_t last_ = 0;  ///< where the last datagram starts; zero: none
  std::uint8_t index_;
  bool overflow_ = false;
};

using MacAddress = std::array<std::uint8_t, 6>;

/// Puts an EtherCAT frame into an Ethernet II frame to the broadcast address, padded to 60 bytes.
[[nodiscard]] Result<ConstBytes, FrameError> encode_ethernet(Bytes buffer, const MacAddress& source,
                                                             ConstBytes frame) noexcept;
/// The EtherCAT frame inside an Ethernet II frame.
[[nodiscard]] Result<Bytes, FrameError> decode_ethernet(Bytes ethernet) noexcept;
/// What the first SubDevice does to a frame that passed it: bit 1 of the source address
/// (locally administered) is set, so that both directions can be told apart.
void mark_returned(Bytes ethernet) noexcept;

}  // namespace ftcs::ethercat
