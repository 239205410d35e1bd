// SPDX-License-Identifier: MIT
#include "ftcs/daemon/security_file.h"

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

using platform::CodeKind;

/// The error, or "".
std::string wrong_with(std::string_view text) {
  const auto parsed = parse_security_file(text);
  return parsed ? "" : parsed.error();
}

TEST(SecurityFile, reads_what_ptp4l_reads) {
  const auto parsed = parse_security_file(
      "# comment\n"
      "\n"
      "[security_association]\n"
      "spp 0\n"
      "allow_mutable 1\n"
      "  1 SHA256-128 \t HEX:F8ADc6  \r\n"
      "[Security_Association]\n"
      "spp 255\n"
      "seqid_window 20\n"
      "seqnum_length 0\n"
      "4294967295 SHA256 3 abc\n"
      "2 AES128 ASCII:abcdefghijklmnop\n"
      "3 AES256 32 B64:PKTF9VQz94qPaoAzW4eE3JtFoQ8Ov1OTQSojalWyMbs=");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ASSERT_EQ(parsed->size(), 2U);
  const AssociationLines& first = parsed->at(0);
  EXPECT_EQ(first.spp, 0);
  EXPECT_EQ(first.seqid_window, 3);
  EXPECT_TRUE(first.allow_mutable);
  ASSERT_EQ(first.keys.size(), 1U);
  EXPECT_EQ(first.keys[0].id, 1U);
  EXPECT_EQ(first.keys[0].kind, CodeKind::kHmacSha256Truncated);
  EXPECT_EQ(first.keys[0].key, (std::vector<std::uint8_t>{0xF8, 0xAD, 0xC6}));
  const AssociationLines& second = parsed->at(1);
  EXPECT_EQ(second.spp, 255);
  EXPECT_EQ(second.seqid_window, 20);
  EXPECT_FALSE(second.allow_mutable);
  ASSERT_EQ(second.keys.size(), 3U);
  EXPECT_EQ(second.keys[0].id, 4294967295U);
  EXPECT_EQ(second.keys[0].key, (std::vector<std::uint8_t>{'a', 'b', 'c'}));
  EXPECT_EQ(second.keys[1].key.size(), 16U);
  ASSERT_EQ(second.keys[2].key.size(), 32U);
  EXPECT_EQ(second.keys[2].key.front(), 0x3C);
  EXPECT_EQ(second.keys[2].key.back(), 0xBB);
}

TEST(SecurityFile, decodes_base64_with_each_padding) {
  const auto parsed =
      parse_security_file("spp 1\n1 SHA256 B64:Zg==\n2 SHA256 B64:Zm8=\n3 SHA256 B64:Zm9v");
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed->at(0).keys[0].key, (std::vector<std::uint8_t>{'f'}));
  EXPECT_EQ(parsed->at(0).keys[1].key, (std::vector<std::uint8_t>{'f', 'o'}));
  EXPECT_EQ(parsed->at(0).keys[2].key, (std::vector<std::uint8_t>{'f', 'o', 'o'}));
}

TEST(SecurityFile, says_in_which_line_what_is_wrong) {
  EXPECT_EQ(wrong_with("spp 256"), "line 1: spp: expected a number, 0 to 255");
  EXPECT_EQ(wrong_with("spp 1\nspp 1"), "line 2: spp 1 comes twice");
  EXPECT_EQ(wrong_with("1 SHA256 abc"),
            "line 1: expected 'spp N' at the beginning of an association");
  EXPECT_EQ(wrong_with("spp 1\n[security_association]\n1 SHA256 abc"),
            "line 3: expected 'spp N' at the beginning of an association");
  EXPECT_EQ(wrong_with("spp 1\nseqid_window 32768"),
            "line 2: seqid_window: expected a number, 0 to 32767");
  EXPECT_EQ(wrong_with("spp 1\nres_length 4"), "line 2: res_length: expected a number, 0 to 0");
  EXPECT_EQ(wrong_with("spp 1\nwindow 3"),
            "line 2: expected seqid_window, allow_mutable or a key: id type [length] value");
  EXPECT_EQ(wrong_with("spp 1\n0 SHA256 abc"),
            "line 2: the id of a key: expected a number, 1 to 4294967295");
  EXPECT_EQ(wrong_with("spp 1\n1 MD5 abc"),
            "line 2: key 1: its type: expected SHA256-128, SHA256, AES128 or AES256");
  EXPECT_EQ(wrong_with("spp 1\n1 AES128 abc"), "line 2: key 1: has 3 octets, AES128 needs 16");
  EXPECT_EQ(wrong_with("spp 1\n1 SHA256 4 abc"), "line 2: key 1: has 3 octets, its length says 4");
  EXPECT_EQ(wrong_with("spp 1\n1 SHA256 abc\n1 SHA256 def"), "line 3: key 1 comes twice");
}

TEST(SecurityFile, repeats_no_key_in_an_error) {
  for (const char* key : {"HEX:5ecre", "HEX:5ecret", "B64:5ecret", "B64:5e!ret=="}) {
    const std::string wrong = wrong_with(std::string("spp 1\n1 SHA256 ") + key);
    EXPECT_NE(wrong, "");
    EXPECT_EQ(wrong.find("5e"), std::string::npos) << wrong;
  }
  // In the place of something else.
  for (const char* line : {"HEX:5e 1", "1 HEX:5e SHA256", "1 HEX:5e 1 SHA256", "HEX:5e SHA256 1",
                           "1 SHA256 HEX:5e abc"}) {
    const std::string wrong = wrong_with(std::string("spp 1\n") + line);
    EXPECT_NE(wrong, "");
    EXPECT_EQ(wrong.find("5e"), std::string::npos) << wrong;
  }
}

TEST(SecurityFile, holds_sixteen_keys_and_no_more) {
  std::string text = "spp 1\n";
  for (int id = 1; id <= 16; ++id) text += std::to_string(id) + " SHA256 abc\n";
  EXPECT_EQ(wrong_with(text), "");
  EXPECT_EQ(wrong_with(text + "17 SHA256 abc"), "line 18: more than 16 keys in one association");
}

}  // namespace
}  // namespace ftcs::daemon
