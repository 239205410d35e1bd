// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

namespace ftcs::experiment {

/// What a long computation reports and obeys.
struct JobControl {
  unsigned threads = 0;                     ///< 0: one for each core
  const std::atomic<bool>* stop = nullptr;  ///< set: no further job begins; finished ones are kept
  std::function<void(std::size_t done, std::size_t total)>
      progress;  ///< called by one thread at a time
};

/// Runs job(0) .. job(count - 1), each once, on several threads; jobs must not depend on each
/// other. Returns how many were run. An exception of a job ends the rest and is thrown again here.
std::size_t run_jobs(std::size_t count, const JobControl& control,
                     const std::function<void(std::size_t)>& job);

}  // namespace ftcs::experiment
