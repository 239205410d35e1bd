// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/wire/frame.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
/// Type 1 in bits 12 to 15 of the frame header: datagrams (ETG.1000.4, 5.2.4).
constexpr std::uint16_t kDatagramType = 1;
constexpr unsigned kTypeShift = 12;
constexpr std::size_t kEtherTypeAt = 12;
constexpr std::uint8_t kLocallyAdministered = 0x02;
}  // namespace

const char* name(FrameError error) noexcept {
  switch (error) {
    case FrameError::kTooShort:
      return "frame too short";
    case FrameError::kForeign:
      return "not an EtherCAT frame";
    case FrameError::kNotDatagrams:
      return "EtherCAT frame without datagrams";
    case FrameError::kLengthBeyondFrame:
      return "length of the header beyond the end of the frame";
    case FrameError::kDatagramTruncated:
      return "datagram truncated";
    case FrameError::kUnknownCommand:
      return "unknown command";
    case FrameError::kNoRoom:
      return "frame full";
  }
  return "unknown frame error";
}

Result<FrameView, FrameError> FrameView::parse(Bytes frame) noexcept {
  if (frame.size() < kFrameHeaderSize) return FrameError::kTooShort;
  const auto header = load<std::uint16_t>(frame, 0);
  if (header >> kTypeShift != kDatagramType) return FrameError::kNotDatagrams;
  const std::size_t length = header & kLengthMask;
  if (length > frame.size() - kFrameHeaderSize) return FrameError::kLengthBeyondFrame;
  const Bytes content = frame.subspan(kFrameHeaderSize, length);
  std::size_t at = 0;
  std::size_t count = 0;
  bool more = true;
  while (more) {
    const Bytes rest = content.subspan(at);
    if (rest.size() < kDatagramOverhead) return FrameError::kDatagramTruncated;
    if (rest[0] > kLastCommand) return FrameError::kUnknownCommand;
    const auto length_and_flags = load<std::uint16_t>(rest, 6);
    const std::size_t size = kDatagramOverhead + (length_and_flags & kLengthMask);
    if (rest.size() < size) return FrameError::kDatagramTruncated;
    more = (length_and_flags & kMoreFollowsFlag) != 0;
    at += size;
    ++count;
  }
  return FrameView{content.first(at), count};
}

Bytes FrameWriter::add(const Target& target, std::size_t size) noexcept {
  const std::size_t limit = std::min(buffer_.size(), kMaxFrameSize);
  if (overflow_ || size > kLengthMask || used_ + kDatagramOverhead + size > limit) {
    overflow_ = true;
    return {};
  }
  if (last_ != 0) {
    const auto flags = load<std::uint16_t>(buffer_, last_ + 6);
    store(buffer_, last_ + 6, static_cast<std::uint16_t>(flags | kMoreFollowsFlag));
  }
  last_ = used_;
  const Bytes bytes = buffer_.subspan(used_, kDatagramOverhead + size);
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  bytes[0] = static_cast<std::uint8_t>(target.command);
  bytes[1] = index_;
  store(bytes, 2, target.position);
  store(bytes, 4, target.offset);
  store(bytes, 6, static_cast<std::uint16_t>(size));
  used_ += bytes.size();
  return bytes.subspan(kDatagramHeaderSize, size);
}

Bytes FrameWriter::add(const Target& target, ConstBytes data) noexcept {
  const Bytes place = add(target, data.size());
  std::copy_n(data.begin(), place.size(), place.begin());
  return place;
}

Result<ConstBytes, FrameError> FrameWriter::finish() noexcept {
  if (overflow_ || buffer_.size() < kFrameHeaderSize) return FrameError::kNoRoom;
  const auto length = static_cast<std::uint16_t>(used_ - kFrameHeaderSize);
  store(buffer_, 0, static_cast<std::uint16_t>(length | (kDatagramType << kTypeShift)));
  return ConstBytes{buffer_.first(used_)};
}

Result<ConstBytes, FrameError> encode_ethernet(Bytes buffer, const MacAddress& source,
                                               ConstBytes frame) noexcept {
  const std::size_t size = std::max(kEthernetHeaderSize + frame.size(), kMinEthernetSize);
  if (size > buffer.size() || size > kMaxEthernetSize) return FrameError::kNoRoom;
  const Bytes ethernet = buffer.first(size);
  std::fill(ethernet.begin(), ethernet.end(), std::uint8_t{0});
  std::fill_n(ethernet.begin(), source.size(), std::uint8_t{0xFF});
  std::copy(source.begin(), source.end(), ethernet.subspan(source.size()).begin());
  // The EtherType alone is big-endian: it belongs to Ethernet.
  ethernet[kEtherTypeAt] = kEtherType >> 8;
  ethernet[kEtherTypeAt + 1] = kEtherType & 0xFF;
  std::copy(frame.begin(), frame.end(), ethernet.begin() + kEthernetHeaderSize);
  return ConstBytes{ethernet};
}

Result<Bytes, FrameError> decode_ethernet(Bytes ethernet) noexcept {
  if (ethernet.size() < kEthernetHeaderSize) return FrameError::kTooShort;
  const unsigned type = (unsigned{ethernet[kEtherTypeAt]} << 8) | ethernet[kEtherTypeAt + 1];
  if (type != kEtherType) return FrameError::kForeign;
  return ethernet.subspan(kEthernetHeaderSize);
}

void mark_returned(Bytes ethernet) noexcept {
  constexpr std::size_t kSourceAt = 6;
  if (ethernet.size() > kSourceAt) ethernet[kSourceAt] |= kLocallyAdministered;
}

}  // namespace ftcs::ethercat
