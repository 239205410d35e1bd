// SPDX-License-Identifier: MIT
#include "ftcs/platform/durable_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sys/stat.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

class DurableFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("ftcs-durable-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(folder_ / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder_), {});
  }
  std::filesystem::path folder_;
};

TEST_F(DurableFile, replaces_the_old_content_and_leaves_nothing_beside_it) {
  EXPECT_EQ(write_durably(folder_ / "a", "one"), std::nullopt);
  EXPECT_EQ(write_durably(folder_ / "a", "another one"), std::nullopt);
  EXPECT_EQ(content("a"), "another one");
  EXPECT_EQ(files(), 1);
}

// A collector of metrics is another user than the one who writes them, as a service with a umask.
TEST_F(DurableFile, may_be_read_by_everybody_where_that_is_asked_for) {
  using std::filesystem::perms;
  const mode_t before = ::umask(077);
  EXPECT_EQ(write_durably(folder_ / "a", "one", Readers::kEverybody), std::nullopt);
  EXPECT_EQ(write_durably(folder_ / "b", "one"), std::nullopt);
  ::umask(before);
  const perms own = perms::owner_read | perms::owner_write;
  EXPECT_EQ(std::filesystem::status(folder_ / "a").permissions(),
            own | perms::group_read | perms::others_read);
  EXPECT_EQ(std::filesystem::status(folder_ / "b").permissions(), own);
}

TEST_F(DurableFile, a_failure_names_the_file_and_costs_nothing) {
  const auto missing = write_durably(folder_ / "none" / "a", "x");
  ASSERT_TRUE(missing.has_value());
  EXPECT_NE(missing->find("none/a: No such file or directory"), std::string::npos) << *missing;
  std::filesystem::create_directories(folder_ / "taken" / "inside");
  EXPECT_TRUE(write_durably(folder_ / "taken", "x").has_value());  // a folder is in the way
  EXPECT_EQ(files(), 1);
}

// Whoever may write into the folder can guess the name that a file without one is given.
TEST_F(DurableFile,
       what_has_the_name_that_it_wanted_for_a_moment_is_neither_touched_nor_in_the_way) {
  const std::string wanted = "a." + std::to_string(getpid());
  std::ofstream(folder_ / wanted) << "of somebody else";
  EXPECT_EQ(write_durably(folder_ / "a", "one"), std::nullopt);
  EXPECT_EQ(content("a"), "one");
  EXPECT_EQ(content(wanted), "of somebody else");
  EXPECT_EQ(files(), 2);
}

// --driftfile /dev/null: the device node became a file, for the whole machine.
TEST_F(DurableFile, what_is_no_regular_file_is_not_replaced) {
  const auto pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/null", folder_ / "link");
  for (const char* name : {"pipe", "link"}) {
    const auto problem = write_durably(folder_ / name, "x");
    ASSERT_TRUE(problem.has_value()) << name;
    EXPECT_NE(problem->find("no regular file"), std::string::npos) << *problem;
  }
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link"));
  EXPECT_EQ(files(), 2);
}

}  // namespace
}  // namespace ftcs::platform
