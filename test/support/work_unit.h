// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <chrono>

namespace ftcs::test {

/// Whether a sanitizer's own work is in the code: what that costs is not what ships.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kInstrumented = true;
#else
inline constexpr bool kInstrumented = false;
#endif

/// Cost of one unit of work, the least that was seen.
struct WorkUnits {
  double divisions{};  ///< as a multiple of one division in a chain
  double ns{};
};

/// @brief Cost of work as a multiple of work that is known, both measured in turn.
///
/// A limit in nanoseconds is one of the machine: where it clocks lower or shares its core, both are
/// slower by the same factor and the ratio stays. Unit: one division of doubles in a chain in which
/// each needs the result before it (13 to 20 cycles on x86-64; 4 to 5 ns at 3 to 4 GHz).
/// @param batches  times that both are measured; the least of each counts.
/// @param units  units of what is measured in one call of `work`.
template <class Work>
WorkUnits measure_work(int batches, int units, Work work) {
  using Clock = std::chrono::steady_clock;
  using Ns = std::chrono::duration<double, std::nano>;
  constexpr int kDivisions = 10'000;
  double division_ns = 1e9;
  double unit_ns = 1e9;
  for (int batch = 0; batch < batches; ++batch) {
    volatile double divisor = 1.000'000'1;
    double value = 1e300;
    const Clock::time_point begin = Clock::now();
    for (int n = 0; n < kDivisions; ++n) value /= divisor;
    volatile double kept = value;
    static_cast<void>(kept);
    const Clock::time_point middle = Clock::now();
    work();
    const Clock::time_point end = Clock::now();
    division_ns = std::min(division_ns, Ns{middle - begin}.count() / kDivisions);
    unit_ns = std::min(unit_ns, Ns{end - middle}.count() / units);
  }
  return {unit_ns / division_ns, unit_ns};
}

}  // namespace ftcs::test
