// SPDX-License-Identifier: MIT
// World: a scratch folder, a folder that does not exist, and /dev/full, the disk that is always
// full.
#include "ftcs/report/write_file.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sys/resource.h>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

class WriteFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::filesystem::path folder_;
};

TEST_F(WriteFile, writes_all_bytes_and_leaves_nothing_else) {
  const std::string text("a\0b\n", 4);
  EXPECT_FALSE(write_file(folder_ / "x", text).has_value());
  EXPECT_EQ(content(folder_ / "x"), text);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(WriteFile, replaces_an_older_result) {
  EXPECT_FALSE(write_file(folder_ / "x", "old and long").has_value());
  EXPECT_FALSE(write_file(folder_ / "x", "new").has_value());
  EXPECT_EQ(content(folder_ / "x"), "new");
}

TEST_F(WriteFile, names_the_file_and_the_reason) {
  const auto error = write_file(folder_ / "missing" / "x", "text");
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("missing/x: No such file or directory"), std::string::npos);
  EXPECT_TRUE(write_file(folder_, "text").has_value());  // a folder is no file
}

TEST_F(WriteFile, reports_a_full_disk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  const auto error = write_file("/dev/full", std::string(100000, 'x'));
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("No space left on device"), std::string::npos);
  EXPECT_TRUE(
      write_file("/dev/full", "short").has_value());  // noticed at the latest when it is closed
}

// A disk on which no file may be larger than 1,000 octets.
TEST_F(WriteFile, keeps_the_older_result_when_the_disk_is_full) {
  EXPECT_FALSE(write_file(folder_ / "x", "finished").has_value());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1'000, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_TRUE(write_file(folder_ / "x", std::string(100'000, 'x')).has_value());
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(content(folder_ / "x"), "finished");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(WriteFile, what_somebody_laid_in_the_way_is_neither_followed_nor_overwritten) {
  std::ofstream(folder_ / "victim") << "precious";
  std::filesystem::create_symlink(folder_ / "victim", folder_ / "x.part0");
  std::filesystem::create_symlink(folder_ / "not_there", folder_ / "x.part1");
  EXPECT_FALSE(check_writable(folder_ / "x").has_value());
  EXPECT_FALSE(write_file(folder_ / "x", "new").has_value());
  EXPECT_EQ(content(folder_ / "victim"), "precious");
  EXPECT_EQ(content(folder_ / "x"), "new");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "not_there"));
}

TEST_F(WriteFile, tells_beforehand_what_would_fail) {
  const auto missing = check_writable(folder_ / "missing" / "x");
  ASSERT_TRUE(missing.has_value());
  EXPECT_NE(missing->message.find("missing/x: No such file or directory"), std::string::npos);
  const auto folder = check_writable(folder_);
  ASSERT_TRUE(folder.has_value());
  EXPECT_NE(folder->message.find("Is a directory"), std::string::npos);
  EXPECT_FALSE(check_writable("/dev/null").has_value());
}

TEST_F(WriteFile, asking_beforehand_changes_nothing) {
  EXPECT_FALSE(check_writable(folder_ / "new").has_value());
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  EXPECT_FALSE(write_file(folder_ / "x", "finished").has_value());
  EXPECT_FALSE(write_file(folder_ / "x.part0", "of somebody else").has_value());
  EXPECT_FALSE(check_writable(folder_ / "x").has_value());
  EXPECT_EQ(content(folder_ / "x"), "finished");
  EXPECT_EQ(content(folder_ / "x.part0"), "of somebody else");
}

TEST_F(WriteFile, tells_results_that_would_take_the_place_of_an_input_or_of_each_other) {
  std::ofstream(folder_ / "in") << "precious";
  std::filesystem::create_symlink("in", folder_ / "link");
  std::filesystem::create_hard_link(folder_ / "in", folder_ / "hard");
  const std::vector<NamedFile> inputs{{"FILE", folder_ / "in"}};
  for (const auto& path :
       {folder_ / "in", folder_ / "." / "in", folder_ / "link", folder_ / "hard"}) {
    const auto error = check_distinct({{"--csv", path}}, inputs);
    ASSERT_TRUE(error.has_value()) << path;
    EXPECT_EQ(error->message, "--csv " + path.string() + " would overwrite what is read: FILE " +
                                  (folder_ / "in").string() + " is the same file");
  }
  const auto twice =
      check_distinct({{"--json", folder_ / "new"}, {"--csv", folder_ / "." / "new"}}, inputs);
  ASSERT_TRUE(twice.has_value());
  EXPECT_NE(twice->message.find("would overwrite another result: --json"), std::string::npos);
  EXPECT_FALSE(check_distinct({{"--json", folder_ / "new"}, {"--csv", folder_ / "newer"}}, inputs));
  EXPECT_FALSE(check_distinct({{"--json", ""}, {"--csv", ""}}, inputs)) << "none is none";
  EXPECT_FALSE(check_distinct({{"--json", "-"}, {"--csv", "-"}}, inputs));
  EXPECT_FALSE(check_distinct({{"--json", "/dev/null"}, {"--csv", "/dev/null"}}, inputs));
}

}  // namespace
}  // namespace ftcs
