// SPDX-License-Identifier: MIT
//
// The world: keys, data and codes of RFC 4231 (HMAC-SHA-256, section 4.2 to 4.8), RFC 4868 (its
// first 16 octets, 2.7.2.1) and RFC 4493 (CMAC with AES-128, section 4). Octets that somebody else
// computed.
#include "ftcs/platform/keyed_code.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

using Octets = std::vector<std::uint8_t>;

Octets repeated(std::uint8_t octet, std::size_t count) { return Octets(count, octet); }

Octets text(std::string_view characters) { return {characters.begin(), characters.end()}; }

Octets hex(std::string_view digits) {
  Octets octets;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    octets.push_back(
        static_cast<std::uint8_t>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16)));
  }
  return octets;
}

Octets code_of(CodeKind kind, const Octets& key, const Octets& data) {
  const auto code = KeyedCode::open(kind, key);
  EXPECT_TRUE(code.ok());
  Octets result(code_octets(kind));
  const std::span<const std::uint8_t> part = data;
  EXPECT_TRUE((*code)->compute(std::span(&part, 1), result));
  return result;
}

struct Vector {
  Octets key;
  Octets data;
  Octets code;
};

std::vector<Vector> rfc_4231() {
  Octets counting;
  for (std::uint8_t octet = 1; octet <= 25; ++octet) counting.push_back(octet);
  return {
      {repeated(0x0b, 20), text("Hi There"),
       hex("b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7")},
      {text("Jefe"), text("what do ya want for nothing?"),
       hex("5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843")},
      {repeated(0xaa, 20), repeated(0xdd, 50),
       hex("773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe")},
      {counting, repeated(0xcd, 50),
       hex("82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b")},
      {repeated(0xaa, 131), text("Test Using Larger Than Block-Size Key - Hash Key First"),
       hex("60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54")},
      {repeated(0xaa, 131),
       text("This is a test using a larger than block-size key and a larger than block-size data. "
            "The key needs to be hashed before being used by the HMAC algorithm."),
       hex("9b09ffa71b942fcb27635fbcd5b0e944bfdc63644f0713938a7f51535c3a35e2")},
  };
}

TEST(KeyedCode, computes_the_codes_of_rfc_4231) {
  for (const Vector& vector : rfc_4231()) {
    EXPECT_EQ(code_of(CodeKind::kHmacSha256, vector.key, vector.data), vector.code);
  }
}

TEST(KeyedCode, truncates_to_the_first_sixteen_octets) {
  for (const Vector& vector : rfc_4231()) {
    EXPECT_EQ(code_of(CodeKind::kHmacSha256Truncated, vector.key, vector.data),
              Octets(vector.code.begin(), vector.code.begin() + 16));
  }
}

TEST(KeyedCode, computes_the_codes_of_rfc_4493) {
  const Octets key = hex("2b7e151628aed2a6abf7158809cf4f3c");
  const Octets data =
      hex("6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e5130c81c46a35ce411");
  EXPECT_EQ(code_of(CodeKind::kCmacAes128, key, {}), hex("bb1d6929e95937287fa37d129b756746"));
  EXPECT_EQ(code_of(CodeKind::kCmacAes128, key, {data.begin(), data.begin() + 16}),
            hex("070a16b46b4d4144f79bdd9dd04a287c"));
  EXPECT_EQ(code_of(CodeKind::kCmacAes128, key, data), hex("dfa66747de9ae63030ca32611497c827"));
}

TEST(KeyedCode, takes_parts_for_one_message_and_can_be_used_again) {
  const Vector vector = rfc_4231().at(1);
  const auto code = KeyedCode::open(CodeKind::kHmacSha256, vector.key);
  ASSERT_TRUE(code.ok());
  const std::span<const std::uint8_t> data = vector.data;
  const std::array parts{data.first(3), data.subspan(3, 0), data.subspan(3)};
  for (int i = 0; i < 2; ++i) {
    Octets result(32);
    ASSERT_TRUE((*code)->compute(parts, result));
    EXPECT_EQ(result, vector.code);
  }
}

TEST(KeyedCode, refuses_a_key_that_its_cipher_cannot_take) {
  EXPECT_FALSE(KeyedCode::open(CodeKind::kCmacAes128, Octets(15)).ok());
  EXPECT_FALSE(KeyedCode::open(CodeKind::kCmacAes256, Octets(33)).ok());
}

TEST(KeyedCode, knows_the_names_of_the_sa_file) {
  EXPECT_EQ(code_kind_from_name("SHA256-128"), CodeKind::kHmacSha256Truncated);
  EXPECT_EQ(code_kind_from_name("sha256"), CodeKind::kHmacSha256);
  EXPECT_EQ(code_kind_from_name("AES128"), CodeKind::kCmacAes128);
  EXPECT_EQ(code_kind_from_name("AES256"), CodeKind::kCmacAes256);
  EXPECT_EQ(code_kind_from_name("MD5"), std::nullopt);
}

}  // namespace
}  // namespace ftcs::platform
