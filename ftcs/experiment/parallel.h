// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

namespace ftcs::experiment {

/// What a long computation reports and obeys.
struct JobControl {
  unsigned threads = 0;  ///< 0: one for each core
  /// Set: no further job begins, one that looks at it ends; finished ones are kept.
  const std::atomic<bool>* stop = nullptr;
  std::function<void(std::size_t done, std::size_t total)>
      progress;  ///< called by one thread at a time
};

/// Thrown by a job that ends because it was asked to: it counts as not run.
struct Interrupted {};

/// Runs job(0) .. job(count - 1), each once, on several threads; jobs must not depend on each
/// other. Returns how many were run. Another exception of a job ends the rest and is thrown again
/// here.
std::size_t run_jobs(std::size_t count, const JobControl& control,
                     const std::function<void(std::size_t)>& job);

}  // namespace ftcs::experiment
