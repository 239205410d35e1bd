// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/sii_image.h"

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <span>

namespace ftcs::ethercat {

namespace {

constexpr std::uint16_t kReadEightBytes = 0x0040;
constexpr std::uint16_t kWriteEnable = 0x0001;
constexpr std::uint16_t kCommandMask = 0x0700;
constexpr std::uint16_t kCommandRead = 0x0100;
constexpr std::uint16_t kCommandWrite = 0x0200;
constexpr std::uint16_t kCommandReload = 0x0400;
constexpr std::uint16_t kChecksumError = 0x0800;
constexpr std::uint16_t kMissingAcknowledge = 0x2000;

/// Appends words and categories behind the fixed part of an image.
class Appender {
 public:
  explicit Appender(Bytes image) noexcept : image_(image) {}
  void begin(std::uint16_t category) noexcept {
    put(category);
    start_ = at_;
    put(std::uint16_t{0});
  }
  void put(std::uint8_t value) noexcept { image_[at_++] = value; }
  void put(std::uint16_t value) noexcept {
    store(image_, at_, value);
    at_ += 2;
  }
  void put(std::uint32_t value) noexcept {
    store(image_, at_, value);
    at_ += 4;
  }
  void put_string(const char* text) noexcept {
    const std::size_t size = std::strlen(text);
    put(static_cast<std::uint8_t>(size));
    for (std::size_t i = 0; i < size; ++i) put(static_cast<std::uint8_t>(text[i]));
  }
  /// Pads to whole words and writes the length.
  void finish() noexcept {
    if ((at_ - start_) % 2 != 0) put(std::uint8_t{0});
    store(image_, start_, static_cast<std::uint16_t>((at_ - start_ - 2) / 2));
  }

 private:
  Bytes image_;
  std::size_t at_ = sii::kCategoriesWord * 2;
  std::size_t start_ = 0;
};

void put_word(SiiImage& image, std::size_t word, std::uint16_t value) noexcept {
  store(Bytes{image}, word * 2, value);
}

void put_fixed_part(SiiImage& image, const Identity& identity, std::uint16_t alias) noexcept {
  std::fill_n(image.begin(), sii::kCategoriesWord * 2, std::uint8_t{0});
  put_word(image, 0x00, 0x0C08);  // PDI: SPI
  put_word(image, 0x02, 0x03E8);  // SYNC impulse 10 us
  put_word(image, sii::kAliasWord, alias);
  put_word(image, sii::kChecksumWord, sii_checksum(image));
  // In bytes: the words 0x08, 0x0A, 0x0C, 0x0E.
  store(Bytes{image}, 0x10, identity.vendor);
  store(Bytes{image}, 0x14, identity.product);
  store(Bytes{image}, 0x18, identity.revision);
  store(Bytes{image}, 0x1C, identity.serial);
  // Bootstrap and standard mailboxes are the same windows.
  for (const std::size_t at : {std::size_t{0x14}, sii::kMailboxWord}) {
    put_word(image, at, 0x1000);
    put_word(image, at + 1, 128);
    put_word(image, at + 2, 0x1080);
    put_word(image, at + 3, 128);
  }
  put_word(image, sii::kProtocolsWord, sii::kProtocolCoe);
  put_word(image, sii::kSizeWord, static_cast<std::uint16_t>(sizeof(SiiImage) * 8 / 1024 - 1));
  put_word(image, sii::kSizeWord + 1, 1);
}

void put_pdo(Appender& out, std::uint16_t category, std::uint16_t index, std::uint8_t manager,
             std::span<const std::uint32_t> entries) noexcept {
  out.begin(category);
  out.put(index);
  out.put(static_cast<std::uint8_t>(entries.size()));
  out.put(manager);
  out.put(std::uint8_t{0});   // not DC-synchronised by itself
  out.put(std::uint8_t{4});   // name
  out.put(std::uint16_t{0});  // flags
  for (const std::uint32_t entry : entries) {
    out.put(static_cast<std::uint16_t>(entry >> 16));
    out.put(static_cast<std::uint8_t>(entry >> 8));
    out.put(std::uint8_t{0});  // name
    out.put(std::uint8_t{0});  // data type
    out.put(static_cast<std::uint8_t>(entry));
    out.put(std::uint16_t{0});
  }
  out.finish();
}

void put_general(Appender& out) noexcept {
  constexpr std::uint8_t kSdo = 0x01;
  constexpr std::uint8_t kAssignAndConfigure = 0x0C;
  out.begin(sii::kGeneral);
  for (const std::uint8_t value :
       {std::uint8_t{1}, std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{0},
        std::uint8_t{kSdo | kAssignAndConfigure}, std::uint8_t{0}, std::uint8_t{0}}) {
    out.put(value);
  }
  for (int i = 0; i < 24; ++i) out.put(std::uint8_t{0});
  out.finish();
}

void put_sync_managers(Appender& out, std::uint16_t outputs, std::uint16_t inputs) noexcept {
  struct Manager {
    std::uint16_t start;
    std::uint16_t length;
    std::uint8_t control;
    std::uint8_t type;
  };
  const Manager managers[] = {{0x1000, 128, 0x26, 1},
                              {0x1080, 128, 0x22, 2},
                              {0x1100, outputs, 0x64, 3},
                              {0x1400, inputs, 0x20, 4}};
  out.begin(sii::kSyncManagers);
  for (const Manager& manager : managers) {
    out.put(manager.start);
    out.put(manager.length);
    out.put(manager.control);
    out.put(std::uint8_t{0});
    out.put(std::uint8_t{1});
    out.put(manager.type);
  }
  out.finish();
}

void put_strings(Appender& out, std::initializer_list<const char*> strings) noexcept {
  out.begin(sii::kStrings);
  out.put(static_cast<std::uint8_t>(strings.size()));
  for (const char* string : strings) out.put_string(string);
  out.finish();
}

void put_fmmus(Appender& out) noexcept {
  out.begin(sii::kFmmus);
  for (const std::uint8_t use : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) out.put(use);
  out.finish();
}

}  // namespace

SiiImage make_bridge_image(const Identity& identity, std::uint16_t alias) noexcept {
  SiiImage image;
  image.fill(0xFF);
  put_fixed_part(image, identity, alias);
  Appender out(image);
  put_strings(out, {"FTCS-BRIDGE", "FTCS modelled bridge terminal", "DC", "time stamps"});
  put_general(out);
  put_fmmus(out);
  put_sync_managers(out, 0, 22);
  constexpr std::uint32_t kStamps[] = {0x10F40102, 0x00000006, 0x00000005, 0x10F40E01, 0x10F40F01,
                                       0x10F41001, 0x10F41140, 0x10F41240, 0x10F41320};
  put_pdo(out, sii::kTxPdo, obj::kStampMap, 3, kStamps);
  out.put(sii::kEnd);
  return image;
}

SiiImage make_drive_image(const Identity& identity, std::uint16_t alias, bool with_dc) noexcept {
  SiiImage image;
  image.fill(0xFF);
  put_fixed_part(image, identity, alias);
  Appender out(image);
  put_strings(out, {"FTCS-DRIVE", "FTCS modelled servo drive", "DC", "CSP"});
  put_general(out);
  put_fmmus(out);
  put_sync_managers(out, 7, 7);
  constexpr std::uint32_t kInputs[] = {0x60410010, 0x60640020, 0x60610008};
  constexpr std::uint32_t kOutputs[] = {0x60400010, 0x607A0020, 0x60600008};
  put_pdo(out, sii::kTxPdo, 0x1A00, 3, kInputs);
  put_pdo(out, sii::kRxPdo, 0x1600, 2, kOutputs);
  if (with_dc) {
    out.begin(sii::kDc);
    for (int i = 0; i < 3; ++i) out.put(std::uint32_t{0});  // cycle, shifts
    out.put(std::uint16_t{1});                              // SYNC1 factor
    out.put(std::uint16_t{0x0300});                         // AssignActivate: SYNC0
    out.put(std::uint16_t{1});                              // SYNC0 factor
    out.put(std::uint8_t{3});                               // name
    for (int i = 0; i < 5; ++i) out.put(std::uint8_t{0});
    out.finish();
  }
  out.put(sii::kEnd);
  return image;
}

void SiiInterface::power_on() noexcept {
  memory_.set(reg::kStationAlias, load<std::uint16_t>(image_, sii::kAliasWord * 2));
  memory_.set(reg::kSiiControl, kReadEightBytes);
}

void SiiInterface::read(std::uint32_t word) noexcept {
  constexpr std::size_t kBytes = 8;
  for (std::size_t i = 0; i < kBytes; ++i) {
    const std::uint64_t at = std::uint64_t{word} * 2 + i;
    memory_.set(reg::kSiiData + i,
                at < image_.size() ? image_[static_cast<std::size_t>(at)] : std::uint8_t{0xFF});
  }
}

bool SiiInterface::write(std::uint32_t word) noexcept {
  const std::uint64_t at = std::uint64_t{word} * 2;
  if (at + 2 > image_.size()) return false;
  store(Bytes{image_}, static_cast<std::size_t>(at), memory_.get<std::uint16_t>(reg::kSiiData));
  return true;
}

void SiiInterface::execute() noexcept {
  const auto control = memory_.get<std::uint16_t>(reg::kSiiControl);
  const auto address = memory_.get<std::uint32_t>(reg::kSiiAddress);
  unsigned status = kReadEightBytes;
  switch (control & kCommandMask) {
    case 0:
      break;  // clears the error bits
    case kCommandRead:
      read(address);
      break;
    case kCommandWrite:
      if ((control & kWriteEnable) == 0 || !write(address)) status |= kMissingAcknowledge;
      break;
    case kCommandReload:
      memory_.set(reg::kStationAlias, load<std::uint16_t>(image_, sii::kAliasWord * 2));
      if (sii_checksum(image_) != image_[sii::kChecksumWord * 2]) status |= kChecksumError;
      break;
    default:
      status |= kMissingAcknowledge;
  }
  memory_.set(reg::kSiiControl, static_cast<std::uint16_t>(status));
}

}  // namespace ftcs::ethercat
