// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/wire/mailbox.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {

constexpr std::uint16_t kServiceRequest = 2;
constexpr std::uint16_t kServiceResponse = 3;
constexpr unsigned kServiceShift = 12;
constexpr std::size_t kExpeditedMax = 4;

/// Command specifiers in bits 5 to 7; flags below (ETG.1000.6, tables 30 to 45).
constexpr std::uint8_t kCommandMask = 0xE0;
constexpr std::uint8_t kDownload = 0x20;      // request
constexpr std::uint8_t kUpload = 0x40;        // request and response
constexpr std::uint8_t kDownloadDone = 0x60;  // response
constexpr std::uint8_t kAbortCommand = 0x80;
constexpr std::uint8_t kSizeIndicated = 0x01;
constexpr std::uint8_t kExpedited = 0x02;
constexpr std::uint8_t kCompleteAccess = 0x10;

/// Data of an initiate download request or upload response.
Result<ConstBytes, MailboxError> decode_data(ConstBytes sdo, std::uint8_t command) noexcept {
  const ConstBytes field = sdo.subspan(4, 4);
  if ((command & kExpedited) != 0) {
    const std::size_t unused = (command & kSizeIndicated) != 0 ? (command >> 2) & 3U : 0;
    return field.first(kExpeditedMax - unused);
  }
  const std::size_t size = load<std::uint32_t>(field, 0);
  const ConstBytes rest = sdo.subspan(kSdoHeaderSize);
  if (size > rest.size()) return MailboxError::kSegmentedTransfer;
  return rest.first(size);
}

std::uint8_t command_of(const Sdo& sdo) noexcept {
  switch (sdo.kind) {
    case SdoKind::kUploadRequest:
    case SdoKind::kUploadResponse:
      return kUpload;
    case SdoKind::kDownloadRequest:
      return kDownload;
    case SdoKind::kDownloadResponse:
      return kDownloadDone;
    case SdoKind::kAbort:
      break;
  }
  return kAbortCommand;
}

bool is_response(SdoKind kind) noexcept {
  return kind == SdoKind::kUploadResponse || kind == SdoKind::kDownloadResponse;
}

}  // namespace

const char* name(MailboxError error) noexcept {
  switch (error) {
    case MailboxError::kTooShort:
      return "mailbox message too short";
    case MailboxError::kNotCoe:
      return "mailbox message of another protocol";
    case MailboxError::kNotSdo:
      return "CoE message that is no SDO";
    case MailboxError::kBadSdo:
      return "malformed SDO";
    case MailboxError::kSegmentedTransfer:
      return "segmented SDO transfer is not supported";
  }
  return "unknown mailbox error";
}

const char* name(SdoAbort abort) noexcept {
  switch (abort) {
    case SdoAbort::kNone:
      return "no abort";
    case SdoAbort::kUnknownCommand:
      return "command specifier unknown";
    case SdoAbort::kUnsupportedAccess:
      return "unsupported access";
    case SdoAbort::kWriteOnly:
      return "object is write only";
    case SdoAbort::kReadOnly:
      return "object is read only";
    case SdoAbort::kNoSuchObject:
      return "object does not exist";
    case SdoAbort::kCannotBeMapped:
      return "object cannot be mapped";
    case SdoAbort::kMappingTooLong:
      return "mapped objects too long";
    case SdoAbort::kLengthMismatch:
      return "length does not match";
    case SdoAbort::kNoSuchSubindex:
      return "subindex does not exist";
    case SdoAbort::kValueOutOfRange:
      return "value out of range";
    case SdoAbort::kGeneral:
      return "general error";
    case SdoAbort::kWrongState:
      return "not in this state";
  }
  return "unknown abort code";
}

std::uint32_t Sdo::value() const noexcept {
  std::uint32_t result = 0;
  for (std::size_t i = 0; i < std::min(data.size(), kExpeditedMax); ++i) {
    result |= std::uint32_t{data[i]} << (8 * i);
  }
  return result;
}

Result<Sdo, MailboxError> decode_sdo(ConstBytes mailbox) noexcept {
  if (mailbox.size() < kMailboxHeaderSize) return MailboxError::kTooShort;
  const std::size_t length = load<std::uint16_t>(mailbox, 0);
  if (length > mailbox.size() - kMailboxHeaderSize) return MailboxError::kTooShort;
  if ((mailbox[5] & 0x0F) != kMailboxTypeCoe) return MailboxError::kNotCoe;
  const ConstBytes coe = mailbox.subspan(kMailboxHeaderSize, length);
  if (coe.size() < kCoeHeaderSize + kSdoHeaderSize) return MailboxError::kTooShort;
  const unsigned service = load<std::uint16_t>(coe, 0) >> kServiceShift;
  if (service != kServiceRequest && service != kServiceResponse) return MailboxError::kNotSdo;

  const ConstBytes bytes = coe.subspan(kCoeHeaderSize);
  const std::uint8_t command = bytes[0];
  Sdo sdo;
  sdo.counter = static_cast<std::uint8_t>((mailbox[5] >> 4) & kMaxMailboxCounter);
  sdo.object = {load<std::uint16_t>(bytes, 1), bytes[3]};
  sdo.complete_access = (command & kCompleteAccess) != 0;
  const bool response = service == kServiceResponse;
  bool carries_data = false;
  switch (command & kCommandMask) {
    case kUpload:
      sdo.kind = response ? SdoKind::kUploadResponse : SdoKind::kUploadRequest;
      carries_data = response;
      break;
    case kDownload:
      if (response) return MailboxError::kBadSdo;
      sdo.kind = SdoKind::kDownloadRequest;
      carries_data = true;
      break;
    case kDownloadDone:
      // In a request the same bits ask for the next segment of an upload.
      if (!response) return MailboxError::kSegmentedTransfer;
      sdo.kind = SdoKind::kDownloadResponse;
      break;
    case kAbortCommand:
      sdo.kind = SdoKind::kAbort;
      sdo.abort = static_cast<SdoAbort>(load<std::uint32_t>(bytes, 4));
      break;
    default:
      return MailboxError::kBadSdo;
  }
  if (carries_data) {
    const auto data = decode_data(bytes, command);
    if (!data) return data.error();
    sdo.data = *data;
  }
  return sdo;
}

bool encode_sdo(Bytes mailbox, const Sdo& sdo) noexcept {
  const bool carries_data =
      sdo.kind == SdoKind::kUploadResponse || sdo.kind == SdoKind::kDownloadRequest;
  const bool expedited = !sdo.data.empty() && sdo.data.size() <= kExpeditedMax;
  const std::size_t extra = carries_data && !expedited ? sdo.data.size() : 0;
  if (mailbox.size() < kSdoOverhead + extra) return false;
  std::fill(mailbox.begin(), mailbox.end(), std::uint8_t{0});
  store(mailbox, 0, static_cast<std::uint16_t>(kCoeHeaderSize + kSdoHeaderSize + extra));
  mailbox[5] = static_cast<std::uint8_t>(kMailboxTypeCoe | (sdo.counter << 4));
  const std::uint16_t service = is_response(sdo.kind) ? kServiceResponse : kServiceRequest;
  store(mailbox, kMailboxHeaderSize, static_cast<std::uint16_t>(service << kServiceShift));

  const Bytes bytes = mailbox.subspan(kMailboxHeaderSize + kCoeHeaderSize);
  unsigned command = command_of(sdo) | (sdo.complete_access ? kCompleteAccess : 0U);
  store(bytes, 1, sdo.object.index);
  bytes[3] = sdo.object.subindex;
  if (sdo.kind == SdoKind::kAbort) store(bytes, 4, static_cast<std::uint32_t>(sdo.abort));
  if (carries_data && expedited) {
    const auto unused = static_cast<unsigned>(kExpeditedMax - sdo.data.size());
    command |= kExpedited | kSizeIndicated | (unused << 2);
    std::copy(sdo.data.begin(), sdo.data.end(), bytes.begin() + 4);
  } else if (carries_data) {
    command |= kSizeIndicated;
    store(bytes, 4, static_cast<std::uint32_t>(sdo.data.size()));
    std::copy(sdo.data.begin(), sdo.data.end(), bytes.begin() + kSdoHeaderSize);
  }
  bytes[0] = static_cast<std::uint8_t>(command);
  return true;
}

}  // namespace ftcs::ethercat
