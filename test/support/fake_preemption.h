// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>

#include "test/support/fake_clocks.h"

namespace ftcs::platform {

/// A busy machine: between any two readings of clocks, and before or after a command, other
/// programs take the processor at random, sometimes several times in a row.
class FakePreemption {
 public:
  struct Config {
    double probability = 0.02;  ///< of each call
    double again = 0.7;         ///< of the next call after one that was preempted
    double longest_ns = 6e6;
  };

  FakePreemption(FakeClocks& kernel, std::uint64_t seed) : FakePreemption(kernel, seed, Config{}) {}
  FakePreemption(FakeClocks& kernel, std::uint64_t seed, const Config& config)
      : kernel_(kernel), config_(config), random_(seed) {
    kernel_.on_clock_read = kernel_.on_adjust = [this] { happen(); };
  }
  ~FakePreemption() { kernel_.on_clock_read = kernel_.on_adjust = nullptr; }
  FakePreemption(const FakePreemption&) = delete;
  FakePreemption& operator=(const FakePreemption&) = delete;

 private:
  void happen() {
    std::uniform_real_distribution<double> uniform;
    preempted_ = uniform(random_) < (preempted_ ? config_.again : config_.probability);
    if (preempted_) kernel_.run(config_.longest_ns * (0.5 + 0.5 * uniform(random_)));
  }

  FakeClocks& kernel_;
  Config config_;
  std::mt19937_64 random_;
  bool preempted_ = false;
};

}  // namespace ftcs::platform
