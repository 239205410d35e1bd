// SPDX-License-Identifier: MIT
#include "ftcs/record/line_reader.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <zlib.h>

namespace ftcs {
namespace {

constexpr std::size_t kBufferSize = 65536;
constexpr std::size_t kLongestExcerpt = 40;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool is_text(char byte) {
  const auto code = static_cast<unsigned char>(byte);
  return code >= 0x20U || byte == '\t' || byte == '\r' || byte == '\f';
}

std::string reason_of(int code) {
  return code == 0 ? "it cannot be read" : std::generic_category().message(code);
}

}  // namespace

struct LineReader::File {
  gzFile handle = nullptr;
  std::array<char, kBufferSize> buffer{};
  std::size_t position = 0;
  std::size_t size = 0;
};

void LineReader::Close::operator()(File* file) const noexcept {
  if (file->handle != nullptr) gzclose_r(file->handle);
  delete file;  // NOLINT(cppcoreguidelines-owning-memory)
}

std::string ReadError::text() const {
  const std::string place = line == 0 ? file : file + ":" + std::to_string(line);
  return place + ": " + message;
}

std::string quoted_excerpt(std::string_view text) {
  std::string shown = "'";
  for (const char byte : text.substr(0, kLongestExcerpt)) {
    shown += byte >= ' ' && byte <= '~' ? byte : '?';
  }
  return shown + (text.size() > kLongestExcerpt ? "...'" : "'");
}

LineReader::LineReader(std::string path, std::unique_ptr<File, Close> file)
    : path_(std::move(path)), file_(std::move(file)) {}

Result<LineReader, ReadError> LineReader::open(const std::string& path) {
  std::unique_ptr<File, Close> file(new File);
  errno = 0;
  constexpr int kStandardInput = 0;
  file->handle = path == "-" ? gzdopen(kStandardInput, "rb") : gzopen(path.c_str(), "rb");
  const std::string shown = path == "-" ? "standard input" : path;
  if (file->handle == nullptr) return ReadError{shown, 0, reason_of(errno)};
  return LineReader(shown, std::move(file));
}

ReadError LineReader::error_here(std::string message) const {
  return {path_, line_number_, std::move(message)};
}

bool LineReader::fill() {
  errno = 0;
  const int count = gzread(file_->handle, file_->buffer.data(), kBufferSize);
  if (count > 0) {
    file_->position = 0;
    file_->size = static_cast<std::size_t>(count);
    return true;
  }
  const int cause = errno;
  int code = Z_OK;
  const char* message = gzerror(file_->handle, &code);
  if (count == 0 && code == Z_OK) return false;
  // A short gzip file gives Z_BUF_ERROR with a count of zero.
  error_ = ReadError{path_, line_number_,
                     code == Z_BUF_ERROR ? "the gzip data ends too early (a truncated file?)"
                     : code == Z_ERRNO   ? reason_of(cause)
                                         : std::string("the gzip data is damaged: ") + message};
  return false;
}

std::optional<std::string_view> LineReader::next() {
  if (error_) return std::nullopt;
  line_.clear();
  while (true) {
    if (file_->position == file_->size && !fill()) {
      if (error_ || line_.empty()) return std::nullopt;
      break;  // the last line has no end
    }
    const char* begin = file_->buffer.data() + file_->position;
    const char* end = file_->buffer.data() + file_->size;
    const char* stop = std::find(begin, end, '\n');
    line_.append(begin, stop);
    file_->position += static_cast<std::size_t>(stop - begin);
    if (line_.size() > kLongestLine) {
      ++line_number_;
      error_ = error_here("this line is longer than 65536 characters: not a text file?");
      return std::nullopt;
    }
    if (stop != end) {
      ++file_->position;
      break;
    }
  }
  ++line_number_;
  if (line_number_ == 1 && line_.starts_with(kByteOrderMark)) line_.erase(0, kByteOrderMark.size());
  if (!line_.empty() && line_.back() == '\r') line_.pop_back();
  if (!std::all_of(line_.begin(), line_.end(), is_text)) {
    error_ = error_here("expected text or gzip, got binary data");
    return std::nullopt;
  }
  return std::string_view(line_);
}

}  // namespace ftcs
