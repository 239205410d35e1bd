// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <cstdint>

#include "ftcs/ethercat/wire/bytes.h"
#include "ftcs/time/result.h"

namespace ftcs::ethercat {

/// Why a mailbox holds no SDO that we understand.
enum class MailboxError : std::uint8_t {
  kTooShort,           ///< less than a mailbox header, or than its length says
  kNotCoe,             ///< another protocol (EoE, FoE, mailbox error reply)
  kNotSdo,             ///< CoE, but an emergency, an SDO information service, ...
  kBadSdo,             ///< an SDO command that does not exist or is truncated
  kSegmentedTransfer,  ///< valid, but not supported
};
[[nodiscard]] const char* name(MailboxError error) noexcept;

/// Mailbox header (ETG.1000.4, 5.6): length 2, address 2, channel and priority 1, type and
/// counter 1.
inline constexpr std::size_t kMailboxHeaderSize = 6;
inline constexpr std::size_t kCoeHeaderSize = 2;
inline constexpr std::size_t kSdoHeaderSize = 8;
inline constexpr std::size_t kSdoOverhead = kMailboxHeaderSize + kCoeHeaderSize + kSdoHeaderSize;
inline constexpr std::uint8_t kMailboxTypeCoe = 3;
inline constexpr std::uint8_t kMaxMailboxCounter = 7;

/// SDO abort codes (ETG.1000.6, 5.6.2.7.2).
enum class SdoAbort : std::uint32_t {
  kNone = 0,
  kUnknownCommand = 0x05040001,     ///< the command byte of the SDO
  kUnsupportedAccess = 0x06010000,  ///< as complete access where there is none
  kWriteOnly = 0x06010001,          ///< it was read
  kReadOnly = 0x06010002,           ///< it was written
  kNoSuchObject = 0x06020000,       ///< index
  kCannotBeMapped = 0x06040041,     ///< the object has no place in process data
  kMappingTooLong = 0x06040042,     ///< more than the PDO holds
  kLengthMismatch = 0x06070010,     ///< of the value
  kNoSuchSubindex = 0x06090011,     ///< the index is there
  kValueOutOfRange = 0x06090030,
  kGeneral = 0x08000000,
  kWrongState = 0x08000022,  ///< it can be written in another state alone, mostly PREOP
};
[[nodiscard]] const char* name(SdoAbort abort) noexcept;

/// Upload: the MainDevice reads the object; download: it writes it.
enum class SdoKind : std::uint8_t {
  kUploadRequest,
  kUploadResponse,
  kDownloadRequest,
  kDownloadResponse,
  kAbort,
};

/// Of an entry in the object dictionary, written 0x1C32:02.
struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  friend constexpr auto operator<=>(ObjectAddress, ObjectAddress) noexcept = default;
};

/// A service data object of CAN application protocol over EtherCAT, expedited or normal in one
/// piece (ETG.1000.6, 5.6.2). `data` refers to the mailbox that was decoded.
struct Sdo {
  SdoKind kind = SdoKind::kUploadRequest;
  ObjectAddress object;
  std::uint8_t counter = 0;  ///< 1 to 7: a repeated message is known by it
  bool complete_access = false;
  SdoAbort abort = SdoAbort::kNone;
  ConstBytes data;

  /// The first four bytes of data as a number (fewer: the rest is zero).
  [[nodiscard]] std::uint32_t value() const noexcept;
};

/// What a mailbox holds, from its header on; an abort is a value (kAbort), no error.
[[nodiscard]] Result<Sdo, MailboxError> decode_sdo(ConstBytes mailbox) noexcept;
/// Writes the message into a mailbox; false if it does not fit. Up to four bytes of data go
/// expedited.
[[nodiscard]] bool encode_sdo(Bytes mailbox, const Sdo& sdo) noexcept;

}  // namespace ftcs::ethercat
