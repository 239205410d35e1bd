// SPDX-License-Identifier: MIT
#include "ftcs/experiment/parallel.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace ftcs::experiment {

std::size_t run_jobs(std::size_t count, const JobControl& control,
                     const std::function<void(std::size_t)>& job) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::size_t done = 0;
  std::exception_ptr error;
  std::mutex mutex;

  const auto work = [&] {
    for (;;) {
      if (failed || (control.stop != nullptr && control.stop->load())) return;
      const std::size_t index = next.fetch_add(1);
      if (index >= count) return;
      try {
        job(index);
      } catch (const Interrupted&) {
        return;
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!error) error = std::current_exception();
        failed = true;
        return;
      }
      const std::scoped_lock lock(mutex);
      ++done;
      if (control.progress) control.progress(done, count);
    }
  };

  const unsigned wanted =
      control.threads != 0 ? control.threads : std::thread::hardware_concurrency();
  const std::size_t threads = std::min<std::size_t>(std::max(wanted, 1U), count);
  {
    std::vector<std::jthread> pool;
    for (std::size_t i = 1; i < threads; ++i) pool.emplace_back(work);
    work();
  }
  if (error) std::rethrow_exception(error);
  return done;
}

}  // namespace ftcs::experiment
