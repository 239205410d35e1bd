// SPDX-License-Identifier: MIT
// World: files in a scratch folder, plain, compressed and spoilt.
#include "ftcs/record/line_reader.h"

#include <filesystem>
#include <fstream>
#include <zlib.h>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

class LineReaderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = ::testing::TempDir() + "ftcs_" +
            ::testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void write(std::string_view content) { std::ofstream(path_, std::ios::binary) << content; }
  void write_gzip(const std::string& content) {
    gzFile file = gzopen(path_.c_str(), "wb");
    gzwrite(file, content.data(), static_cast<unsigned>(content.size()));
    gzclose(file);
  }
  /// All lines, and the error behind them as a last one.
  std::vector<std::string> lines() {
    std::vector<std::string> all;
    auto reader = LineReader::open(path_);
    if (!reader) return {reader.error().text()};
    while (const auto line = reader->next()) all.emplace_back(*line);
    if (reader->error()) all.push_back(reader->error()->text());
    return all;
  }

  std::string path_;
};

using Lines = std::vector<std::string>;

TEST_F(LineReaderTest, gives_lines_without_their_ends) {
  write("a\r\n\nb");
  EXPECT_EQ(lines(), (Lines{"a", "", "b"}));
}

TEST_F(LineReaderTest, skips_a_byte_order_mark_at_the_start_alone) {
  write("\xEF\xBB\xBFtime,offset_ns\r\n\xEF\xBB\xBFx\n");
  EXPECT_EQ(lines(), (Lines{"time,offset_ns", "\xEF\xBB\xBFx"}));
  write_gzip("\xEF\xBB\xBF\n1\n");
  EXPECT_EQ(lines(), (Lines{"", "1"}));
  write("\xEF\xBB");
  EXPECT_EQ(lines(), (Lines{"\xEF\xBB"}));
}

TEST_F(LineReaderTest, reads_gzip_as_if_it_were_plain) {
  std::string content;
  for (int i = 0; i < 50000; ++i) content += std::to_string(i) + "\n";
  write_gzip(content);
  const Lines all = lines();
  ASSERT_EQ(all.size(), 50000U);
  EXPECT_EQ(all[49999], "49999");
}

TEST_F(LineReaderTest, tells_a_truncated_gzip_file) {
  std::string content;
  for (int i = 0; i < 50000; ++i) content += std::to_string(i * 7919 % 100003) + "\n";
  write_gzip(content);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) / 2);
  EXPECT_NE(lines().back().find("ends too early"), std::string::npos) << lines().back();
}

TEST_F(LineReaderTest, tells_a_damaged_gzip_file) {
  write_gzip(std::string(100000, 'x') + "\n");
  std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(20);
  file << "damage";
  file.close();
  EXPECT_NE(lines().back().find("gzip data"), std::string::npos) << lines().back();
}

TEST_F(LineReaderTest, refuses_binary_data_with_the_line) {
  write(
      std::string_view("1\n2\n\x7f"
                       "ELF\0\1\n",
                       11));
  EXPECT_EQ(lines().back(), path_ + ":3: expected text or gzip, got binary data");
}

TEST_F(LineReaderTest, refuses_a_line_without_end) {
  write(std::string(1000000, '1'));
  EXPECT_NE(lines().back().find("longer than"), std::string::npos);
}

TEST_F(LineReaderTest, names_the_reason_when_there_is_no_file) {
  EXPECT_EQ(lines().back(), path_ + ": No such file or directory");
  path_ = ::testing::TempDir();
  EXPECT_NE(lines().back().find("directory"), std::string::npos) << lines().back();
  path_ = "nothing";
}

TEST_F(LineReaderTest, of_an_empty_file_gives_nothing) {
  write("");
  EXPECT_TRUE(lines().empty());
}

TEST(QuotedExcerpt, cannot_spoil_a_terminal) {
  EXPECT_EQ(quoted_excerpt("a\x1b[31m"), "'a?[31m'");
  EXPECT_EQ(quoted_excerpt(std::string(100, 'x')).size(), 45U);
}

}  // namespace
}  // namespace ftcs
