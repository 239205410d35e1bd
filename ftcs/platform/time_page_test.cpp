// SPDX-License-Identifier: MIT
// World: a page in a temporary folder, a writer and readers of it.
#include "ftcs/platform/time_page.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

class TimePageTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "ftcs-page-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
    path_ = folder_ + "/time";
    auto opened = TimePage::open(path_);
    ASSERT_TRUE(opened.ok()) << opened.error().message();
    page_.emplace(std::move(*opened));
    reader_ = ftcs_open_time(path_.c_str());
    ASSERT_NE(reader_, nullptr);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
  std::string path_;
  std::optional<TimePage> page_;
  const ftcs_time_page* reader_ = nullptr;
};

TEST_F(TimePageTest, tells_the_time_between_two_instants_and_how_far_it_has_grown) {
  ftcs_time now{};
  EXPECT_EQ(ftcs_now(reader_, &now), FTCS_UNKNOWN) << "nothing was written yet";
  constexpr double kFast = 1.0 / (1 << 20);  // exact: 953.67 ns in a second
  page_->write({FTCS_LOCKED, 1'000, 5'000'000'000, 1.0 + kFast, 100.0, 1e-7});
  ASSERT_EQ(ftcs_time_at(reader_, 1'000 + 1'000'000'000, &now), FTCS_LOCKED);
  EXPECT_EQ(now.time_ns, 6'000'000'953);
  EXPECT_EQ(now.earliest_ns, 6'000'000'953 - 200 - 2);
  EXPECT_EQ(now.latest_ns, 6'000'000'953 + 200 + 2);
  EXPECT_EQ(ftcs_time_at(reader_, 1'000 + 4'000'000'000, &now), FTCS_HOLDOVER) << "no news";
  EXPECT_EQ(now.latest_ns - now.earliest_ns, 2 * 502);
  page_.reset();
  EXPECT_EQ(ftcs_now(reader_, &now), FTCS_UNKNOWN) << "the writer has ended";
}

TEST_F(TimePageTest, has_one_writer) {
  const auto second = TimePage::open(path_);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().number, EBUSY);
  page_->write({FTCS_LOCKED, 1'000, 5'000'000'000, 1.0, 100.0, 1e-7});
  ftcs_time now{};
  EXPECT_EQ(ftcs_time_at(reader_, 1'000, &now), FTCS_LOCKED) << "the refused one changed nothing";
  page_.reset();
  EXPECT_TRUE(TimePage::open(path_).ok()) << "the lock goes with its writer";
}

// A page on a disk, whose writer ended with the machine: CLOCK_MONOTONIC_RAW begins again.
TEST_F(TimePageTest, a_page_from_before_a_restart_tells_nothing) {
  ftcs_time now{};
  page_->write({FTCS_LOCKED, 9'000'000'000'000, 5'000'000'000, 1.0, 100.0, 1e-7});
  EXPECT_EQ(ftcs_time_at(reader_, 60'000'000'000, &now), FTCS_UNKNOWN);
  EXPECT_EQ(ftcs_time_at(reader_, 8'999'000'000'000, &now), FTCS_LOCKED) << "a stamp of just now";
}

TEST_F(TimePageTest, a_file_that_is_no_page_yet_is_not_mapped) {
  std::ofstream(folder_ + "/empty").close();
  EXPECT_EQ(ftcs_open_time((folder_ + "/empty").c_str()), nullptr);
}

TEST_F(TimePageTest, a_reader_never_sees_half_of_a_write) {
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::int64_t n = 0; !stop; ++n) {
      page_->write({FTCS_LOCKED, n, 10 * n, 1.0, static_cast<double>(100 * n), 0.0});
    }
  });
  std::uint64_t read = 0;
  std::uint64_t torn = 0;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds{5};
  while (read < 300'000 && std::chrono::steady_clock::now() < until) {
    ftcs_time now{};
    if (ftcs_time_at(reader_, 0, &now) != FTCS_LOCKED) continue;
    ++read;
    // time = 10 n - n, half width = 100 n + 2
    const std::int64_t n = now.time_ns / 9;
    if (now.latest_ns - now.time_ns != 100 * n + 2) ++torn;
  }
  stop = true;
  writer.join();
  EXPECT_GT(read, 1'000U);
  EXPECT_EQ(torn, 0U);
}

TEST_F(TimePageTest, a_reader_cannot_write) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::signal(SIGSEGV, SIG_DFL);  // a sanitizer would report it and leave
    *const_cast<volatile std::uint32_t*>(&reader_->state) = FTCS_LOCKED;
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV);
  struct stat file {};
  ASSERT_EQ(::stat(path_.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0644U);
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(TimePageTest, a_file_of_somebody_else_is_left_as_it_is) {
  constexpr std::size_t kPage = 4096;
  const std::string path = folder_ + "/other";
  for (const std::string& text : {std::string("precious\n"), std::string(kPage, 'x'),
                                  std::string(kPage - 1, '\0'), std::string(2 * kPage, '\0')}) {
    std::ofstream(path, std::ios::binary) << text;
    ASSERT_EQ(::chmod(path.c_str(), 0600), 0);
    const auto opened = TimePage::open(path);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().message(),
              "time page " + path + ": it holds something else and is left as it is");
    EXPECT_EQ(content(path), text);
    struct stat file {};
    ASSERT_EQ(::stat(path.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0777, 0600U);
  }
}

TEST_F(TimePageTest, an_empty_file_an_older_page_and_an_unfinished_one_are_taken) {
  std::ofstream(folder_ + "/empty").close();
  std::ofstream(folder_ + "/zeros", std::ios::binary) << std::string(4096, '\0');
  page_.reset();
  for (const std::string& path : {folder_ + "/empty", folder_ + "/zeros", path_}) {
    const auto opened = TimePage::open(path);
    EXPECT_TRUE(opened.ok()) << path;
    EXPECT_NE(ftcs_open_time(path.c_str()), nullptr) << path;
  }
}

TEST_F(TimePageTest, links_and_what_is_no_file_are_refused) {
  std::filesystem::create_symlink(path_, folder_ + "/link");
  EXPECT_FALSE(TimePage::open(folder_ + "/link").ok());
  EXPECT_FALSE(TimePage::open(folder_).ok());
  EXPECT_FALSE(TimePage::open("/dev/null").ok());
  EXPECT_FALSE(TimePage::open(folder_ + "/none/time").ok());
}

}  // namespace
}  // namespace ftcs::platform
