// SPDX-License-Identifier: MIT
//
// The world: a file of keys that changes, and octets that ptp4l 4.4 of Debian's newer suite (with
// libnettle) sent with the same keys, recorded on a veth pair with tshark.
#include "ftcs/daemon/security.h"

#include <filesystem>
#include <fstream>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "ftcs/ptp/wire/codec.h"

namespace ftcs::daemon {
namespace {

using ptp::Authenticity;

constexpr const char* kKeys =
    "[security_association]\n"
    "spp 1\n"
    "1 SHA256-128 HEX:F8ADC6B8B8E9AA709106BA42481EC9E29607334DE2C3C737A11A12931DB27F8C\n"
    "2 SHA256 32 HEX:EE91D469B3A8ADC6AC8EB28E21794C706E08FDE48863828A7B0281AFCA81B17D\n"
    "3 AES128 HEX:FAF48EBA01E7C5966A76CB787AED4E7B\n"
    "4 AES256 B64:PKTF9VQz94qPaoAzW4eE3JtFoQ8Ov1OTQSojalWyMbs=\n"
    "5 SHA256 26 abcdefghijklmnopqrstuvwxyz\n";

/// What ptp4l 4.4 sent by each key: an Announce, a Sync, and three Follow_Ups.
constexpr std::string_view kOfPtp4l[] = {
    "0b12005a000000000000000000000000000000000e4740fffe5b5c540001000000fe000000000000000000000025"
    "0080f8feffff800e4740fffe5b5c540000a0800900160100000000015737077ea3a840aed485e44f720be7c7",
    "00120056000002000000000000000000000000000e4740fffe5b5c54000100000000000000000000000000008009"
    "00260100000000023d94bbb5570099e9f57df0329fdf92dd143dd9812acd17db3e12ee1cb0d21c73",
    "08120046000000000000000000000000000000000e4740fffe5b5c5400010000000000006b0395f1241b38048009"
    "00160100000000030dffe2f8545ed90dfe381a7e508376e7",
    "08120046000000000000000000000000000000000e4740fffe5b5c5400010000000000006b0395f81c15721f8009"
    "0016010000000004ab3198a4db3c2709cf7e19e3be59d12c",
    "08120056000000000000000000000000000000000e4740fffe5b5c5400010000000000006b0395ff1e26aaa18009"
    "00260100000000053d50458f8afef03ea64e299345bdce61fc5a581f1398aec441322f7fe81f87f1"};

std::vector<std::uint8_t> hex(std::string_view digits) {
  std::vector<std::uint8_t> octets;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    octets.push_back(
        static_cast<std::uint8_t>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16)));
  }
  return octets;
}

class KeyFile : public testing::Test {
 protected:
  KeyFile() { write(kKeys); }
  ~KeyFile() override { std::filesystem::remove(path_); }
  void write(std::string_view text) const { std::ofstream(path_) << text; }
  [[nodiscard]] SecurityOptions options(std::uint32_t active = 1, std::uint8_t spp = 1) const {
    return {path_, spp, active};
  }

  std::string path_ = testing::TempDir() + "/ftcs-keys-" + std::to_string(getpid());
};

TEST_F(KeyFile, verifies_what_ptp4l_sent_by_each_type_of_key) {
  Security security(options());
  ASSERT_EQ(security.load(), std::nullopt);
  for (const std::string_view sent : kOfPtp4l) {
    auto octets = hex(sent);
    ASSERT_TRUE(ptp::decode(octets).ok());
    EXPECT_EQ(ptp::authenticate(security.association(), octets), Authenticity::kAuthentic);
    for (std::size_t i = 0; i < octets.size(); ++i) {
      octets[i] ^= 0x10;
      EXPECT_NE(ptp::authenticate(security.association(), octets), Authenticity::kAuthentic) << i;
      octets[i] ^= 0x10;
    }
  }
}

TEST_F(KeyFile, seals_as_ptp4l_does) {
  for (std::uint32_t key = 1; key <= 5; ++key) {
    Security security(options(key));
    ASSERT_EQ(security.load(), std::nullopt);
    const auto sent = hex(kOfPtp4l[key - 1]);
    // The message without its TLV, as encode() leaves it, and its messageLength.
    ptp::MessageBytes bytes;
    bytes.size = key == 1 ? 64 : 44;
    std::copy_n(sent.begin(), bytes.size, bytes.octets.begin());
    bytes.octets[3] = bytes.size;
    ASSERT_TRUE(ptp::seal(security.association(), bytes));
    EXPECT_EQ(std::vector<std::uint8_t>(bytes.view().begin(), bytes.view().end()), sent);
  }
}

TEST_F(KeyFile, keeps_its_keys_when_the_file_becomes_wrong) {
  Security security(options());
  ASSERT_EQ(security.load(), std::nullopt);
  write("spp 1\n1 SHA256\n");
  EXPECT_NE(security.load(), std::nullopt);
  EXPECT_EQ(security.association().key_count, 5U);
  EXPECT_EQ(ptp::authenticate(security.association(), hex(kOfPtp4l[0])), Authenticity::kAuthentic);
}

TEST_F(KeyFile, forgets_a_key_that_is_no_longer_there) {
  Security security(options());
  ASSERT_EQ(security.load(), std::nullopt);
  write("spp 1\n1 SHA256 another\n");
  ASSERT_EQ(security.load(), std::nullopt);
  EXPECT_EQ(ptp::authenticate(security.association(), hex(kOfPtp4l[1])), Authenticity::kUnknownKey);
  // The same number, another key of another length of code.
  EXPECT_EQ(ptp::authenticate(security.association(), hex(kOfPtp4l[0])),
            Authenticity::kUnsupported);
  write("spp 1\n1 SHA256-128 another\n");
  ASSERT_EQ(security.load(), std::nullopt);
  EXPECT_EQ(ptp::authenticate(security.association(), hex(kOfPtp4l[0])), Authenticity::kWrongCode);
}

TEST_F(KeyFile, says_what_is_missing) {
  EXPECT_EQ(Security(options(1, 7)).load(), "sa_file " + path_ + ": has no spp 7");
  EXPECT_EQ(Security(options(9)).load(),
            "sa_file " + path_ + ": spp 1 has no key 9 (active_key_id)");
  EXPECT_EQ(Security({path_ + "-none", 1, 1}).load(),
            "sa_file " + path_ + "-none: No such file or directory");
  EXPECT_EQ(Security({testing::TempDir(), 1, 1}).load(),
            "sa_file " + testing::TempDir() + ": expected a regular file");
}

/// Read again in the loop that steers the clock: it waits for nothing.
TEST_F(KeyFile, keeps_its_keys_when_something_else_takes_the_place_of_the_file) {
  Security security(options());
  ASSERT_EQ(security.load(), std::nullopt);
  const auto still_knows_them = [&security] {
    return ptp::authenticate(security.association(), hex(kOfPtp4l[0])) == Authenticity::kAuthentic;
  };
  const auto wrong_with = [this, &security](const std::string& what) {
    const auto wrong = security.load();
    return wrong == "sa_file " + path_ + ": " + what;
  };
  std::filesystem::remove(path_);
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_TRUE(wrong_with("expected a regular file"));
  std::filesystem::remove(path_);
  std::filesystem::create_directory(path_);
  EXPECT_TRUE(wrong_with("expected a regular file"));
  std::filesystem::remove(path_);
  std::filesystem::create_symlink("/dev/zero", path_);
  EXPECT_TRUE(wrong_with("expected a regular file"));
  std::filesystem::remove(path_);
  write(std::string((1 << 20) + 1, '#'));
  EXPECT_TRUE(wrong_with("more than 1 MiB"));
  write("");
  EXPECT_TRUE(wrong_with("has no spp 1"));
  EXPECT_TRUE(still_knows_them());
}

TEST_F(KeyFile, knows_whether_others_may_read_it) {
  const Security security(options());
  using std::filesystem::perms;
  std::filesystem::permissions(path_, perms::owner_read | perms::others_read);
  EXPECT_TRUE(security.is_readable_by_others());
  std::filesystem::permissions(path_, perms::owner_read | perms::group_read);
  EXPECT_FALSE(security.is_readable_by_others());
}

}  // namespace
}  // namespace ftcs::daemon
