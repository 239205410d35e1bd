// SPDX-License-Identifier: MIT
// The world: CoE messages with the bytes of ETG.1000.6 and hostile ones; SII images.
#include "ftcs/ethercat/wire/mailbox.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ethercat/wire/sii.h"

namespace ftcs::ethercat {
namespace {

TEST(Sdo, an_expedited_download_has_the_bytes_of_the_standard) {
  std::array<std::uint8_t, 16> mailbox{};
  const std::array<std::uint8_t, 1> mode{8};
  ASSERT_TRUE(encode_sdo(
      mailbox, {SdoKind::kDownloadRequest, {0x6060, 0}, 2, false, SdoAbort::kNone, mode}));
  const std::array<std::uint8_t, 16> expected{0x0A, 0,    0,    0, 0, 0x23, 0, 0x20,
                                              0x2F, 0x60, 0x60, 0, 8, 0,    0, 0};
  EXPECT_EQ(mailbox, expected);
}

TEST(Sdo, each_kind_survives_the_wire) {
  const std::vector<std::uint8_t> small{1, 2, 3};
  const std::vector<std::uint8_t> large{1, 2, 3, 4, 5, 6, 7};
  for (const auto kind : {SdoKind::kUploadRequest, SdoKind::kUploadResponse,
                          SdoKind::kDownloadRequest, SdoKind::kDownloadResponse, SdoKind::kAbort}) {
    for (const auto& data : {small, large}) {
      std::array<std::uint8_t, 64> mailbox{};
      const SdoAbort abort = kind == SdoKind::kAbort ? SdoAbort::kNoSuchObject : SdoAbort::kNone;
      ASSERT_TRUE(encode_sdo(mailbox, {kind, {0x1018, 4}, 5, false, abort, data}));
      const auto sdo = decode_sdo(mailbox);
      ASSERT_TRUE(sdo);
      EXPECT_EQ(sdo->kind, kind);
      EXPECT_EQ(sdo->object, (ObjectAddress{0x1018, 4}));
      EXPECT_EQ(sdo->counter, 5);
      EXPECT_EQ(sdo->abort, abort);
      if (kind == SdoKind::kUploadResponse || kind == SdoKind::kDownloadRequest) {
        EXPECT_TRUE(std::equal(data.begin(), data.end(), sdo->data.begin(), sdo->data.end()));
      }
    }
  }
}

TEST(Sdo, what_does_not_fit_is_not_written) {
  std::array<std::uint8_t, 20> mailbox{};
  const std::vector<std::uint8_t> data(5);
  EXPECT_FALSE(encode_sdo(mailbox, {SdoKind::kUploadResponse, {}, 1, false, {}, data}));
}

TEST(Sdo, each_malformation_has_its_name) {
  std::array<std::uint8_t, 16> good{};
  ASSERT_TRUE(encode_sdo(good, {SdoKind::kUploadRequest, {0x1000, 0}, 1, false, {}, {}}));
  const auto error = [&](std::size_t at, std::uint8_t value) {
    auto copy = good;
    copy[at] = value;
    return decode_sdo(copy).error();
  };
  EXPECT_EQ(error(0, 11), MailboxError::kTooShort);
  EXPECT_EQ(error(0, 9), MailboxError::kTooShort);
  EXPECT_EQ(error(5, 0x12), MailboxError::kNotCoe);
  EXPECT_EQ(error(7, 0x10), MailboxError::kNotSdo);
  EXPECT_EQ(error(8, 0xC0), MailboxError::kBadSdo);
  EXPECT_EQ(error(8, 0x60), MailboxError::kSegmentedTransfer);
  auto large = good;
  large[8] = 0x21;  // a normal download that promises more than there is
  large[12] = 200;
  EXPECT_EQ(decode_sdo(large).error(), MailboxError::kSegmentedTransfer);
}

/// Words 0x00 to 0x40, checksum right, an end marker.
std::vector<std::uint8_t> minimal_image() {
  std::vector<std::uint8_t> image(0x41 * 2);
  image[0x08 * 2] = 0x34;
  image[0x07 * 2] = sii_checksum(image);
  image[0x40 * 2] = image[0x40 * 2 + 1] = 0xFF;
  return image;
}

TEST(Sii, the_checksum_is_the_one_of_the_published_polynomial) {
  // CRC-8, polynomial 0x07, start 0xFF, computed by long division on paper for a single byte 0x00.
  const std::array<std::uint8_t, 1> zero{0};
  EXPECT_EQ(sii_checksum(zero), 0xF3);
}

TEST(Sii, each_malformation_has_its_name) {
  ASSERT_TRUE(decode_sii(minimal_image()));
  EXPECT_EQ(decode_sii(minimal_image())->identity.vendor, 0x34U);
  auto image = minimal_image();
  EXPECT_EQ(decode_sii(ConstBytes{image}.first(127)).error(), SiiError::kTooShort);
  EXPECT_EQ(decode_sii(ConstBytes{image}.first(128)).error(), SiiError::kNoEnd);
  image[0] = 1;
  EXPECT_EQ(decode_sii(image).error(), SiiError::kBadChecksum);
  image = minimal_image();
  image[0x40 * 2] = 30, image[0x40 * 2 + 1] = 0;
  image.insert(image.end(), {9, 0, 0, 0});
  EXPECT_EQ(decode_sii(image).error(), SiiError::kCategoryTruncated);
}

}  // namespace
}  // namespace ftcs::ethercat
