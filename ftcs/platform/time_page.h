// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "ftcs/platform/ftcs_now.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// The writer's side of ftcs_now.h: one page of a file that anybody may read and only we may write.
class TimePage {
 public:
  struct Content {
    ftcs_time_state state = FTCS_UNKNOWN;
    std::int64_t raw_ns = 0;
    std::int64_t time_ns = 0;
    double rate = 1.0;
    double bound_ns = 0.0;
    double growth = 0.0;
  };

  /// Makes the file, or takes the one that is there: a regular one, by no link, that is a page
  /// already, or empty, or a page's size of zeros (the machine went down as it was made). Mode
  /// 0644. EBUSY: somebody else writes it. EEXIST: it holds something else, which stays.
  [[nodiscard]] static Result<TimePage, OsError> open(const std::string& path);

  TimePage(TimePage&& other) noexcept;
  TimePage& operator=(TimePage&&) = delete;
  TimePage(const TimePage&) = delete;
  TimePage& operator=(const TimePage&) = delete;
  /// Who reads on learns that nothing is known any more.
  ~TimePage();

  void write(const Content& content) noexcept;

 private:
  TimePage(ftcs_time_page* page, int file) : page_(page), file_(file) {}
  ftcs_time_page* page_ = nullptr;
  int file_ = -1;  ///< open for its lock alone
};

}  // namespace ftcs::platform
