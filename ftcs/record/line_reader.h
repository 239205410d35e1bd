// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/time/result.h"

namespace ftcs {

/// What is wrong with a file, and where: one line for people.
struct ReadError {
  std::string file;
  std::size_t line = 0;  ///< from 1; 0 = the file as a whole
  std::string message;   ///< what was expected, what came

  /// "log.csv:12: expected a number in column 2, got 'abc'".
  [[nodiscard]] std::string text() const;
};

/// A text as it can be shown inside an error: at most 40 characters, others than printable ASCII as
/// '?', in quotes.
[[nodiscard]] std::string quoted_excerpt(std::string_view text);

/// Lines of a text file, gzip or plain, in constant memory. "-" is the standard input. A byte-order
/// mark of UTF-8 at the start, as spreadsheets write it, is no part of the first line.
///
/// A file that is not text (a control character other than tab, form feed and carriage return, or a
/// line above kLongestLine) and a gzip file that ends too early are errors: reading stops there.
class LineReader {
 public:
  static constexpr std::size_t kLongestLine = 65536;

  [[nodiscard]] static Result<LineReader, ReadError> open(const std::string& path);

  /// The next line without its end ("\n" or "\r\n"). Nothing at the end of the file or after an
  /// error. The view holds until the next call.
  [[nodiscard]] std::optional<std::string_view> next();

  /// Number of the line that next() gave last, from 1.
  [[nodiscard]] std::size_t line_number() const noexcept { return line_number_; }
  /// Why next() stopped; nothing at an ordinary end.
  [[nodiscard]] const std::optional<ReadError>& error() const noexcept { return error_; }
  /// An error at the current line of this file.
  [[nodiscard]] ReadError error_here(std::string message) const;

 private:
  struct File;
  struct Close {
    void operator()(File* file) const noexcept;
  };

  LineReader(std::string path, std::unique_ptr<File, Close> file);
  bool fill();

  std::string path_;
  std::unique_ptr<File, Close> file_;
  std::string line_;
  std::size_t line_number_ = 0;
  std::optional<ReadError> error_;
};

}  // namespace ftcs
