// SPDX-License-Identifier: MIT
#include "ftcs/report/write_file.h"

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

namespace ftcs {
namespace {

WriteError failure(const std::filesystem::path& path, int code) {
  return {"cannot write " + path.string() + ": " + std::generic_category().message(code)};
}

/// Zero or the error of the first call that failed. Closing can fail too: that is when a full disk
/// shows.
int write_and_close(std::FILE* file, std::string_view content) {
  int code = 0;
  if (std::fwrite(content.data(), 1, content.size(), file) != content.size()) code = errno;
  if (std::fclose(file) != 0 && code == 0) code = errno;
  return code;
}

struct Part {
  std::FILE* file = nullptr;  ///< null: errno says why
  std::filesystem::path path;
};

/// A file that did not exist: "x" follows no link and opens nothing of somebody else.
Part new_part_of(const std::filesystem::path& path) {
  constexpr int kMostTaken = 100;
  Part part;
  for (int i = 0; i < kMostTaken; ++i) {
    part.path = path;
    part.path += ".part" + std::to_string(i);
    errno = 0;
    part.file = std::fopen(part.path.c_str(), "wbx");
    if (part.file != nullptr || errno != EEXIST) return part;
  }
  return part;
}

std::optional<WriteError> write_directly(const std::filesystem::path& path,
                                         std::string_view content) {
  errno = 0;
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  const int code = file == nullptr ? errno : write_and_close(file, content);
  if (code == 0) return std::nullopt;
  return failure(path, code);
}

bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code problem;
  const auto status = std::filesystem::status(a, problem);
  if (std::filesystem::exists(status) && std::filesystem::exists(b, problem)) {
    return std::filesystem::is_regular_file(status) && std::filesystem::equivalent(a, b, problem);
  }
  const auto whole = [&problem](const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, problem), problem);
  };
  const auto first = whole(a);
  return !first.empty() && first == whole(b);
}

}  // namespace

std::optional<WriteError> write_file(const std::filesystem::path& path, std::string_view content) {
  std::error_code problem;
  const auto status = std::filesystem::status(path, problem);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    return write_directly(path, content);
  }
  const Part part = new_part_of(path);
  if (part.file == nullptr) return failure(path, errno);
  int code = write_and_close(part.file, content);
  problem.clear();
  if (code == 0) std::filesystem::rename(part.path, path, problem);
  if (problem) code = problem.value();
  if (code == 0) return std::nullopt;
  std::filesystem::remove(part.path, problem);
  return failure(path, code);
}

std::optional<WriteError> check_writable(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) return failure(path, EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    return std::nullopt;
  }
  const Part part = new_part_of(path);
  if (part.file == nullptr) return failure(path, errno);
  std::fclose(part.file);
  std::filesystem::remove(part.path, ignored);
  return std::nullopt;
}

std::optional<WriteError> check_distinct(const std::vector<NamedFile>& results,
                                         const std::vector<NamedFile>& inputs) {
  std::vector<const NamedFile*> written;
  for (const NamedFile& result : results) {
    if (result.path.empty() || result.path == "-") continue;
    const std::string named = result.option + " " + result.path.string();
    for (const NamedFile& input : inputs) {
      const auto& source = input.path == "-" ? std::filesystem::path("/dev/stdin") : input.path;
      if (source.empty() || !is_same_file(result.path, source)) continue;
      return WriteError{named + " would overwrite what is read: " + input.option + " " +
                        input.path.string() + " is the same file"};
    }
    for (const NamedFile* other : written) {
      if (!is_same_file(result.path, other->path)) continue;
      return WriteError{named + " would overwrite another result: " + other->option + " " +
                        other->path.string() + " is the same file"};
    }
    written.push_back(&result);
  }
  return std::nullopt;
}

}  // namespace ftcs
