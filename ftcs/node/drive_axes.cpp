// SPDX-License-Identifier: MIT
#include "ftcs/node/drive_axes.h"

namespace ftcs::node {

using ethercat::AxisState;

namespace {
/// Its process data is that of csp_objects(); a bridge terminal's is not.
bool is_axis(ethercat::MainDevice& main, std::size_t n) noexcept {
  return main.outputs(n).size() >= ethercat::csp::kOutputSize &&
         main.inputs(n).size() >= ethercat::csp::kInputSize;
}
}  // namespace

bool DriveAxes::all_enabled(ethercat::MainDevice& main) const noexcept {
  for (std::size_t n = 0; n < main.network().count; ++n) {
    if (is_axis(main, n) && axes_[n].state() != AxisState::kEnabled) return false;
  }
  return true;
}

/// The axis is in Fault, a reset is left to it, and the last one is long enough ago to have failed.
bool DriveAxes::take_reset(std::size_t n, bool fault) noexcept {
  if (!fault || resets_[n] >= config_.fault_resets || cycles_ < next_reset_[n]) return false;
  ++resets_[n];
  next_reset_[n] = cycles_ + kCyclesBetweenResets;
  return true;
}

void DriveAxes::cycle(ethercat::MainDevice& main, bool in_op, double time_s,
                      CycleNotes& notes) noexcept {
  const std::size_t count = main.network().count;
  const bool moving = in_op && config_.move;
  path_.advance(moving && all_enabled(main), time_s);
  for (std::size_t n = 0; n < count; ++n) {
    if (!is_axis(main, n)) continue;
    const auto outputs = main.outputs(n);
    const auto inputs = main.inputs(n);
    if (!main.takes_part(n)) axes_[n].restart();
    const AxisState before = axes_[n].state();
    const bool reset = take_reset(n, moving && before == AxisState::kFault);
    axes_[n]
        .cycle(ethercat::csp::Inputs::decode(inputs),
               {.enable = moving && (before == AxisState::kEnabled || path_.at_rest()),
                .reset_fault = reset,
                .displacement = path_.displacement(n)})
        .encode(outputs);
    const bool faulted = axes_[n].state() == AxisState::kFault;
    if (faulted && before != AxisState::kFault) notes.add(CycleNote::Kind::kAxisFault, n);
    if (reset) notes.add(CycleNote::Kind::kFaultReset, n);
  }
  ++cycles_;
}

}  // namespace ftcs::node
