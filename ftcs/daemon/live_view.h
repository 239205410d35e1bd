// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "ftcs/experiment/servo_trial.h"
#include "ftcs/report/table.h"

namespace ftcs::daemon {

/// |offset| on a logarithmic scale, one character each, the newest on the right: 10 ns is the
/// lowest, 1 ms the highest of eight heights.
[[nodiscard]] std::string offset_plot(std::span<const double> offsets_ns, std::size_t width);

/// A few lines on a terminal that are drawn over again and again; silent where the output is not a
/// terminal.
class LiveView {
 public:
  explicit LiveView(bool enabled) noexcept : enabled_(enabled) {}

  void draw(std::span<const experiment::ServoTrial* const> trials, double elapsed_seconds,
            double total_seconds);
  /// Leaves the last picture standing and the cursor below it.
  void finish();

 private:
  bool enabled_;
  std::size_t drawn_lines_ = 0;
};

}  // namespace ftcs::daemon
