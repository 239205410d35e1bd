// SPDX-License-Identifier: MIT
// World: a pipe that nobody reads for a while.
#include "ftcs/platform/line_writer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <unistd.h>
#include <utility>

#include <gtest/gtest.h>

namespace ftcs::platform {
namespace {

class LineWriterTest : public testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    reader = ends[0];
    stream = ::fdopen(ends[1], "w");
    ASSERT_NE(stream, nullptr);
  }
  void TearDown() override {
    ::close(reader);
    std::fclose(stream);
  }
  /// What has come so far, at most.
  std::string read(std::size_t most) {
    std::string text(most, '\0');
    const ssize_t size = ::read(reader, text.data(), text.size());
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    return text;
  }
  int reader = -1;
  std::FILE* stream = nullptr;
};

TEST_F(LineWriterTest, a_line_is_there_at_once) {
  LineWriter writer(stream);
  writer.write("one\n");
  EXPECT_EQ(read(100), "one\n");
  EXPECT_TRUE(writer.is_empty());
}

TEST_F(LineWriterTest, a_reader_that_stops_is_not_waited_for_and_what_is_lost_is_counted) {
  const std::string line = std::string(99, 'x') + "\n";
  constexpr std::size_t kLines = 10'000;
  std::uint64_t lost = 0;
  std::string all;
  {
    LineWriter writer(stream);
    for (std::size_t i = 0; i < kLines; ++i) writer.write(line);  // would wait for ever
    lost = writer.take_lost();
    EXPECT_GT(lost, kLines / 2);
    EXPECT_EQ(writer.take_lost(), 0U);
    while (!writer.is_empty()) {
      all += read(8'192);
      writer.flush();
    }
  }
  std::fclose(std::exchange(stream, ::fopen("/dev/null", "w")));
  for (std::string more = read(65'536); !more.empty(); more = read(65'536)) all += more;
  EXPECT_EQ(all.size(), (kLines - lost) * line.size()) << "whole lines, in order";
}

TEST_F(LineWriterTest, a_stream_that_cannot_be_written_loses_its_lines_and_no_more) {
  std::FILE* const full = std::fopen("/dev/full", "w");
  if (full == nullptr) GTEST_SKIP() << "there is no /dev/full here";
  {
    LineWriter writer(full);
    writer.write("one\n");
    EXPECT_TRUE(writer.is_empty());
    EXPECT_EQ(writer.error(), ENOSPC);
  }
  std::fclose(full);
}

}  // namespace
}  // namespace ftcs::platform
