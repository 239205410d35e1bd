// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "ftcs/daemon/phc/clock_comparison.h"
#include "ftcs/estimation/sorted_window.h"
#include "ftcs/time/duration.h"
#include "ftcs/time/instant.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::daemon {

/// What one comparison of two clocks says, as messages of a path without delay.
///
/// With w the width of the reading and w0 the usual one, the sink was read at source ± w/2:
///
///   w about w0:  one message, at the source's own time.
///   w >> w0:     two, later and earlier by (w - w0) / 2: which side of the reading was held up is
///                not known, and the servo's gate for late messages finds out.
///   in between:  none. Its middle is off by no more than what is taken for noise, and by the same
///                each time if it comes of one cause, such as a second that has just passed.
///
/// To tell of a usual reading twice would make noise that is in both, as that of the kernel's
/// clock, which runs in multiples of 119 ppb, look like a clock that wanders between readings, and
/// be followed. Only the first readings of a run are told as two in any case: a servo that has
/// heard few messages tells a jump from an outlier by their directions.
class ReadingMessages {
 public:
  struct Message {
    Direction direction;
    ReferenceTime source;
  };

  /// `may_split` false: always one message, the middle. Valid until the next call.
  [[nodiscard]] std::span<const Message> of(const Comparison& comparison, bool may_split) noexcept {
    const auto source = ReferenceTime::from_ns(comparison.source_ns);
    const Surplus surplus = surplus_of(comparison.delay_ns);
    const bool is_young = std::exchange(told_, std::min(told_ + 1, kYoung)) < kYoung;
    const bool is_whole = surplus.kind != Kind::kLarge;
    if (!may_split || (is_whole && !(is_young && comparison.delay_ns > 0))) {
      messages_ = {Message{Direction::kForward, source}};
      return std::span(messages_).first(may_split && surplus.kind == Kind::kSmall ? 0 : 1);
    }
    const Duration half = Duration::from_whole_ns(is_whole ? 0 : surplus.ns).half();
    messages_ = {Message{Direction::kBackward, source + half},
                 Message{Direction::kForward, source - half}};
    return messages_;
  }

 private:
  enum class Kind : std::uint8_t { kNone, kSmall, kLarge };
  struct Surplus {
    std::int64_t ns = 0;
    Kind kind = Kind::kNone;
  };
  /// What a reading is wider by than the median of the last ones. None, if by no more than those
  /// differ from each other; large, if by more than some instructions take: an interrupt, or a bus
  /// that is busy.
  [[nodiscard]] Surplus surplus_of(std::int64_t width_ns) noexcept {
    constexpr double kLeastPart = 1.0 / 64.0;
    constexpr double kLargePart = 1.0 / 16.0;
    constexpr double kSpreads = 3.0;
    widths_.push(static_cast<double>(width_ns));
    const double usual = widths_.median();
    const double ns = static_cast<double>(width_ns) - usual;
    const auto whole_ns = static_cast<std::int64_t>(ns);
    if (ns > kLargePart * usual) return {whole_ns, Kind::kLarge};
    const double spread = std::max(kSpreads * widths_.median_deviation(), kLeastPart * usual);
    return {whole_ns, ns > spread ? Kind::kSmall : Kind::kNone};
  }

  static constexpr std::size_t kRemembered = 15;
  static constexpr int kYoung = 16;
  int told_ = 0;
  estimation::SortedWindow<kRemembered> widths_;
  std::array<Message, 2> messages_{};
};

}  // namespace ftcs::daemon
