// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs::test {

/// While one of these lives, every call of the global operator new in this thread aborts the test
/// program with a message. It turns the promise "no allocation" into a test.
class ForbidAllocation {
 public:
  ForbidAllocation() noexcept;
  ~ForbidAllocation();
  ForbidAllocation(const ForbidAllocation&) = delete;
  ForbidAllocation& operator=(const ForbidAllocation&) = delete;
};

}  // namespace ftcs::test
