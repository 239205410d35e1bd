// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/wire/sii.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {

constexpr std::size_t kBytesPerWord = 2;

std::uint16_t word(ConstBytes image, std::size_t address) noexcept {
  return load<std::uint16_t>(image, address * kBytesPerWord);
}
std::uint32_t double_word(ConstBytes image, std::size_t address) noexcept {
  return load<std::uint32_t>(image, address * kBytesPerWord);
}

/// Category 10: a count, then strings with their length in front; numbered from one.
ConstBytes find_string(ConstBytes strings, std::uint8_t number) noexcept {
  if (strings.empty() || number == 0 || number > strings[0]) return {};
  std::size_t at = 1;
  for (unsigned i = 1; at < strings.size(); ++i) {
    const std::size_t size = strings[at];
    if (at + 1 + size > strings.size()) return {};
    if (i == number) return strings.subspan(at + 1, size);
    at += 1 + size;
  }
  return {};
}

void decode_general(SiiContent& content, ConstBytes general, std::uint8_t& name_index) noexcept {
  constexpr std::size_t kNameIndexAt = 3;
  constexpr std::size_t kCoeDetailsAt = 5;
  constexpr std::size_t kFlagsAt = 0x0B;
  constexpr std::uint8_t kNotLrw = 0x02;
  if (general.size() <= kFlagsAt) return;
  name_index = general[kNameIndexAt];
  content.coe_details = general[kCoeDetailsAt];
  content.logical_read_write_supported = (general[kFlagsAt] & kNotLrw) == 0;
}

bool decode_sync_managers(SiiContent& content, ConstBytes bytes) noexcept {
  const std::size_t count = bytes.size() / reg::kSyncManagerSize;
  if (count > SiiContent::kMaxSyncManagers) return false;
  for (std::size_t i = 0; i < count; ++i) {
    content.sync_managers[i] =
        SyncManagerChannel::decode(bytes.subspan(i * reg::kSyncManagerSize, reg::kSyncManagerSize));
  }
  content.sync_manager_count = count;
  return true;
}

}  // namespace

const char* name(SiiError error) noexcept {
  switch (error) {
    case SiiError::kTooShort:
      return "SII too short";
    case SiiError::kBadChecksum:
      return "SII checksum wrong";
    case SiiError::kCategoryTruncated:
      return "SII category truncated";
    case SiiError::kNoEnd:
      return "SII without end";
    case SiiError::kTooManySyncManagers:
      return "SII with too many sync managers";
  }
  return "unknown SII error";
}

std::uint8_t sii_checksum(ConstBytes first_words) noexcept {
  constexpr unsigned kPolynomial = 0x07;
  unsigned crc = 0xFF;
  const std::size_t size = std::min(first_words.size(), sii::kChecksumWord * kBytesPerWord);
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= first_words[i];
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 0x80U) != 0 ? (crc << 1) ^ kPolynomial : crc << 1;
    }
    crc &= 0xFFU;
  }
  return static_cast<std::uint8_t>(crc);
}

Identity decode_identity(ConstBytes words) noexcept {
  return {double_word(words, 0), double_word(words, 2), double_word(words, 4),
          double_word(words, 6)};
}

Result<SiiContent, SiiError> decode_sii(ConstBytes image) noexcept {
  if (image.size() < sii::kCategoriesWord * kBytesPerWord) return SiiError::kTooShort;
  if (sii_checksum(image) != image[sii::kChecksumWord * kBytesPerWord]) {
    return SiiError::kBadChecksum;
  }
  SiiContent content;
  content.alias = word(image, sii::kAliasWord);
  content.identity = decode_identity(image.subspan(sii::kIdentityWord * 2));
  content.receive = {word(image, 0x18), word(image, 0x19)};
  content.send = {word(image, 0x1A), word(image, 0x1B)};
  content.protocols = word(image, sii::kProtocolsWord);

  ConstBytes strings;
  std::uint8_t name_index = 0;
  std::size_t at = sii::kCategoriesWord * kBytesPerWord;
  while (true) {
    if (at + kBytesPerWord > image.size()) return SiiError::kNoEnd;
    const auto category = load<std::uint16_t>(image, at);
    if (category == sii::kEnd) break;
    if (at + 2 * kBytesPerWord > image.size()) return SiiError::kNoEnd;
    const std::size_t size = load<std::uint16_t>(image, at + kBytesPerWord) * kBytesPerWord;
    at += 2 * kBytesPerWord;
    if (size > image.size() - at) return SiiError::kCategoryTruncated;
    const ConstBytes bytes = image.subspan(at, size);
    if (category == sii::kStrings) strings = bytes;
    if (category == sii::kGeneral) decode_general(content, bytes, name_index);
    if (category == sii::kSyncManagers && !decode_sync_managers(content, bytes)) {
      return SiiError::kTooManySyncManagers;
    }
    constexpr std::size_t kAssignActivateAt = 14;
    if (category == sii::kDc && bytes.size() >= kAssignActivateAt + kBytesPerWord) {
      content.assign_activate = load<std::uint16_t>(bytes, kAssignActivateAt);
    }
    at += size;
  }
  const ConstBytes device_name = find_string(strings, name_index);
  // A name comes from the wire and goes to terminals and files: printable ASCII alone.
  std::transform(device_name.begin(),
                 device_name.begin() + static_cast<std::ptrdiff_t>(
                                           std::min(device_name.size(), SiiContent::kMaxName - 1)),
                 content.device_name.begin(), [](std::uint8_t byte) {
                   return byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '?';
                 });
  return content;
}

}  // namespace ftcs::ethercat
