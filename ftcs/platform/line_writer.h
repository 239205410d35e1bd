// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace ftcs::platform {

/// Lines to a stream whose reader may have stopped: a full pipe, a terminal after Ctrl-S, a journal
/// that stalls. Never waits for it: what cannot be written now is kept, up to kMostKept octets, and
/// what exceeds that is lost and counted. A regular file is always ready, however slow its disk is.
class LineWriter {
 public:
  static constexpr std::size_t kMostKept = 65'536;

  /// The stream must outlive the writer; nobody else may keep anything in its buffer.
  explicit LineWriter(std::FILE* stream) : stream_(stream) {}
  ~LineWriter() { flush(); }
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// A whole line, its end included.
  void write(std::string_view line);
  /// Tries again to write what is kept.
  void flush();
  [[nodiscard]] bool is_empty() const { return kept_.empty(); }
  /// errno of the last write that failed; 0: none has. What could not be written is gone.
  [[nodiscard]] int error() const { return error_; }
  /// Lines lost since the last question, for want of a reader.
  [[nodiscard]] std::uint64_t take_lost();

 private:
  std::FILE* stream_;
  std::string kept_;
  std::uint64_t lost_ = 0;
  int error_ = 0;
};

/// "nobody reads it any more", or the words of that errno.
[[nodiscard]] const char* write_failure(int number) noexcept;
/// Width of the terminal behind standard output; 80 where that is none, or does not tell.
[[nodiscard]] std::size_t terminal_columns() noexcept;

}  // namespace ftcs::platform
