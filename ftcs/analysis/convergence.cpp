// SPDX-License-Identifier: MIT
#include "ftcs/analysis/convergence.h"

namespace ftcs {
namespace {

std::optional<std::uint64_t> count_from(const Convergence& record,
                                        std::optional<std::uint64_t> event,
                                        ConvergenceOrigin origin) noexcept {
  if (!event) return std::nullopt;
  if (origin == ConvergenceOrigin::kFirstMessage) return event;
  if (!record.first_action) return std::nullopt;
  return *event > *record.first_action ? *event - *record.first_action : 0;
}

}  // namespace

std::optional<std::uint64_t> Convergence::cycles_to_converge(
    ConvergenceOrigin origin) const noexcept {
  return count_from(*this, settled, origin);
}

std::optional<std::uint64_t> Convergence::cycles_to_dwell(ConvergenceOrigin origin) const noexcept {
  return count_from(*this, dwelt, origin);
}

Convergence find_convergence(std::span<const double> offsets, double band,
                             std::uint64_t dwell) noexcept {
  ConvergenceTracker tracker(band, dwell);
  for (const double offset : offsets) tracker.add(offset);
  return tracker.result();
}

}  // namespace ftcs
