// SPDX-License-Identifier: MIT
#include "ftcs/report/write_file.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace ftcs {
namespace {

WriteError failure(const std::filesystem::path& path, int code) {
  return {"cannot write " + path.string() + ": " + std::generic_category().message(code)};
}

/// Zero or the error of the first call that failed. Closing can fail too: that is when a full disk
/// shows.
int write_whole(const std::filesystem::path& path, std::string_view content) {
  errno = 0;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return errno;
  int code = 0;
  if (std::fwrite(content.data(), 1, content.size(), file) != content.size()) code = errno;
  if (std::fclose(file) != 0 && code == 0) code = errno;
  return code;
}

/// What write_file() writes to first.
std::filesystem::path part_of(const std::filesystem::path& path) {
  std::filesystem::path part = path;
  part += ".part";
  return part;
}

}  // namespace

std::optional<WriteError> write_file(const std::filesystem::path& path, std::string_view content) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    const int code = write_whole(path, content);
    if (code != 0) return failure(path, code);
    return std::nullopt;
  }
  const std::filesystem::path part = part_of(path);
  if (const int code = write_whole(part, content); code != 0) {
    std::filesystem::remove(part, ignored);
    return failure(path, code);
  }
  std::error_code problem;
  std::filesystem::rename(part, path, problem);
  if (problem) {
    std::filesystem::remove(part, ignored);
    return failure(path, problem.value());
  }
  return std::nullopt;
}

std::optional<WriteError> check_writable(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) return failure(path, EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    return std::nullopt;
  }
  const std::filesystem::path part = part_of(path);
  const bool was_there = std::filesystem::exists(part, ignored);
  errno = 0;
  std::FILE* const file = std::fopen(part.c_str(), "ab");  // appends: leaves what is there
  if (file == nullptr) return failure(path, errno);
  std::fclose(file);
  if (!was_there) std::filesystem::remove(part, ignored);
  return std::nullopt;
}

}  // namespace ftcs
