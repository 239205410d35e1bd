// SPDX-License-Identifier: MIT
#include "ftcs/daemon/live_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include <fmt/format.h>

#include "ftcs/platform/line_writer.h"

namespace ftcs::daemon {
namespace {

constexpr std::size_t kPlotWidth = 40;

std::string_view state_name(const Telemetry& telemetry) {
  switch (telemetry.servo.state) {
    case ServoState::kUnlocked:
      return "unlocked";
    case ServoState::kJump:
      return "jump";
    case ServoState::kLocked:
      return telemetry.locked ? "locked" : "steering";
    case ServoState::kHoldover:
      return "holdover";
  }
  return "";
}

/// A line that the terminal does not wrap: wrapped ones would not be found again by the next
/// picture. `rest(room)` fills what `text`, which is ASCII, leaves.
template <class Rest>
std::string line(std::string text, std::size_t columns, const Rest& rest) {
  const std::size_t room = columns - 1;  // a full last column wraps on some terminals
  text.resize(std::min(text.size(), room));
  return "\x1b[2K" + text + rest(room - text.size()) + "\n";
}

}  // namespace

std::string offset_plot(std::span<const double> offsets_ns, std::size_t width) {
  constexpr std::array<std::string_view, 8> kHeights{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr double kLowestDecade = 1.0;             // 10 ns
  constexpr double kDecades = 6.0 - kLowestDecade;  // up to 1 ms
  std::string plot;
  const std::size_t shown = std::min(width, offsets_ns.size());
  plot.append(width - shown, ' ');
  for (const double offset : offsets_ns.last(shown)) {
    const double decade = std::log10(std::max(std::abs(offset), 1.0));
    const double height = (decade - kLowestDecade) / kDecades * (kHeights.size() - 1);
    plot += kHeights[static_cast<std::size_t>(std::clamp(height, 0.0, 7.0))];
  }
  return plot;
}

void LiveView::draw(std::span<const experiment::ServoTrial* const> trials, double elapsed_seconds,
                    double total_seconds) {
  if (!enabled_) return;
  const std::size_t columns = platform::terminal_columns();
  std::string screen;
  if (drawn_lines_ > 0) screen += fmt::format("\x1b[{}A", drawn_lines_);
  screen += line(fmt::format("{:>13}  {:>13}  {:>13}  {:>14}  {:<8} ",
                             fmt::format("{:.1f} of {:.0f} s", elapsed_seconds, total_seconds),
                             "true offset", "offset it sees", "rate", "state"),
                 columns, [](std::size_t room) {
                   return std::string("|true offset|, 10 ns to 1 ms").substr(0, room);
                 });
  for (const experiment::ServoTrial* trial : trials) {
    const Telemetry& latest = trial->latest();
    const auto& truth = trial->true_offsets_ns();
    screen += line(fmt::format("{:>13}  {:>13}  {:>13}  {:>10.3f} ppm  {:<8} ", trial->name(),
                               truth.empty() ? "" : format_time(truth.back()),
                               format_time(latest.servo.offset.ns()), latest.applied_rate.ppm(),
                               state_name(latest)),
                   columns, [&truth](std::size_t room) {
                     return offset_plot(truth, std::min(room, kPlotWidth));
                   });
  }
  drawn_lines_ = trials.size() + 1;
  std::fputs(screen.c_str(), stdout);
  std::fflush(stdout);
}

void LiveView::finish() {
  if (enabled_ && drawn_lines_ > 0) std::fputs("\n", stdout);
  drawn_lines_ = 0;
}

}  // namespace ftcs::daemon
