// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/wire/channels.h"
#include "ftcs/time/result.h"

namespace ftcs::ethercat {

/// Why an image of the SII cannot be used.
enum class SiiError : std::uint8_t {
  kTooShort,           ///< less than the fixed part of 0x40 words
  kBadChecksum,        ///< CRC-8 of words 0 to 6 does not fit word 7
  kCategoryTruncated,  ///< a category reaches beyond the image
  kNoEnd,              ///< no end marker
  kTooManySyncManagers,
};
[[nodiscard]] const char* name(SiiError error) noexcept;

/// Addresses in words, categories (ETG.1000.6, 5.4; ETG.2010).
namespace sii {
inline constexpr std::size_t kChecksumWord = 0x07;    ///< CRC-8 of the words before, low octet
inline constexpr std::size_t kAliasWord = 0x04;       ///< configured station alias
inline constexpr std::size_t kIdentityWord = 0x08;    ///< vendor, product, revision, serial
inline constexpr std::size_t kMailboxWord = 0x18;     ///< receive and send: start and size
inline constexpr std::size_t kProtocolsWord = 0x1C;   ///< bits: kProtocolCoe, ...
inline constexpr std::size_t kSizeWord = 0x3E;        ///< of the memory, KiBit less 1
inline constexpr std::size_t kCategoriesWord = 0x40;  ///< type, length in words, content; and so on
inline constexpr std::uint16_t kStrings = 10;         ///< all names, by number from 1
inline constexpr std::uint16_t kGeneral = 30;         ///< numbers of names, CoE details, flags
inline constexpr std::uint16_t kFmmus = 40;           ///< what each FMMU is meant for
inline constexpr std::uint16_t kSyncManagers = 41;    ///< start, length, control of each
inline constexpr std::uint16_t kTxPdo = 50;           ///< inputs: sync manager, entries
inline constexpr std::uint16_t kRxPdo = 51;           ///< outputs
inline constexpr std::uint16_t kDc = 60;              ///< modes: cycle, shift, AssignActivate
inline constexpr std::uint16_t kEnd = 0xFFFF;         ///< no more categories
inline constexpr std::uint16_t kProtocolCoe = 0x04;   ///< in kProtocolsWord
}  // namespace sii

/// Who made it, what it is, which one it is (object 0x1018).
struct Identity {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  friend constexpr bool operator==(const Identity&, const Identity&) noexcept = default;
};

/// Octets in the memory of the controller; size 0: there is none.
struct MailboxWindow {
  std::uint16_t start = 0;
  std::uint16_t size = 0;
};

/// What the MainDevice needs of the SubDevice information interface.
struct SiiContent {
  static constexpr std::size_t kMaxSyncManagers = 8;
  static constexpr std::size_t kMaxName = 48;

  std::uint16_t alias = 0;
  Identity identity;
  MailboxWindow receive;  ///< MainDevice to SubDevice
  MailboxWindow send;     ///< SubDevice to MainDevice
  std::uint16_t protocols = 0;
  std::uint8_t coe_details = 0;
  bool logical_read_write_supported = true;
  std::array<SyncManagerChannel, kMaxSyncManagers> sync_managers{};
  std::size_t sync_manager_count = 0;
  std::uint16_t assign_activate = 0;         ///< what to write to 0x0980 for distributed clocks
  std::array<char, kMaxName> device_name{};  ///< zero-terminated, printable ASCII

  /// Objects can be read and written: it says so, and has both mailboxes.
  [[nodiscard]] constexpr bool coe() const noexcept {
    return (protocols & sii::kProtocolCoe) != 0 && receive.size > 0 && send.size > 0;
  }
};

/// x^8 + x^2 + x + 1, start 0xFF, over words 0 to 6 (ETG.1000.6, table 16).
[[nodiscard]] std::uint8_t sii_checksum(ConstBytes first_words) noexcept;
/// Of the four double words at kIdentityWord.
[[nodiscard]] Identity decode_identity(ConstBytes words) noexcept;
/// Checked decoding of a whole image. Unknown categories are skipped.
[[nodiscard]] Result<SiiContent, SiiError> decode_sii(ConstBytes image) noexcept;

}  // namespace ftcs::ethercat
