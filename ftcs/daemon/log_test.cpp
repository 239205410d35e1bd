// SPDX-License-Identifier: MIT
// World: a log into a pipe, and a clock that a test moves.
#include "ftcs/daemon/log.h"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <optional>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::daemon {
namespace {

class LogTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(::pipe2(ends.data(), 0), 0);
    ASSERT_EQ(::fcntl(ends[0], F_SETFL, O_NONBLOCK), 0);  // an empty pipe is an answer
    stream = ::fdopen(ends[1], "w");
    ASSERT_NE(stream, nullptr);
    log.emplace(kernel, stream, 6);
  }
  void TearDown() override {
    log.reset();
    std::fclose(stream);
    ::close(ends[0]);
  }
  std::string read() {
    std::string text(1 << 20, '\0');
    const ssize_t size = ::read(ends[0], text.data(), text.size());
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    return text;
  }
  static std::ptrdiff_t lines(const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  }
  platform::FakeKernel kernel;
  std::array<int, 2> ends{};
  std::FILE* stream = nullptr;
  std::optional<Log> log;
};

TEST_F(LogTest, a_line_has_its_second_and_is_there_at_once) {
  kernel.raw_ns = 5'250'000'000;
  (*log)(LogLevel::kInfo, "{} s", 3);
  EXPECT_EQ(read(), "ftcs[5.250]: 3 s\n");
}

// 250 jumps a second were 250 lines a second.
TEST_F(LogTest, a_flood_is_told_ten_times_a_second_and_how_much_was_left_out) {
  for (int second = 0; second < 2; ++second) {
    for (int i = 0; i < 250; ++i) (*log)(LogLevel::kWarning, "jumped by {} s", i);
    (*log)(LogLevel::kNotice, "another kind");
    kernel.advance(1'000'000'000);
  }
  const std::string text = read();
  EXPECT_EQ(lines(text), 2 * (10 + 1) + 1) << text;
  EXPECT_NE(text.find("240 lines of the next kind left out"), std::string::npos) << text;
}

TEST_F(LogTest, a_flood_of_many_kinds_is_no_more_lines) {
  const auto flood = [this](int seconds) {
    for (int n = 0; n < 10 * seconds; ++n) {
      (*log)(LogLevel::kWarning, "one");
      (*log)(LogLevel::kWarning, "two");
      (*log)(LogLevel::kNotice, "three");
      kernel.advance(100'000'000);
    }
    return lines(read());
  };
  flood(10);  // what a start has room for is used up
  const auto told = flood(60);
  EXPECT_LE(told, 340) << "five a second, and what was kept for a start";
  EXPECT_GE(told, 250);
}

TEST_F(LogTest, samples_are_as_many_as_were_asked_for) {
  for (int i = 0; i < 128; ++i) (*log)(LogLevel::kInfo, "offset {}", i);
  EXPECT_EQ(lines(read()), 128);
}

// The loop stood still in write(2): no steering, no answer, no end by a signal.
TEST_F(LogTest, a_reader_that_stops_is_not_waited_for) {
  const std::string text(200, 'x');
  for (int i = 0; i < 5'000; ++i) (*log)(LogLevel::kInfo, "{}", text);
  std::string all;
  for (int i = 0; i < 5; ++i) {
    all += read();
    log->flush();
  }
  (*log)(LogLevel::kInfo, "still here");
  all += read();
  EXPECT_NE(all.find("lines lost: nobody read them"), std::string::npos);
  EXPECT_NE(all.find("still here"), std::string::npos);
}

}  // namespace
}  // namespace ftcs::daemon
