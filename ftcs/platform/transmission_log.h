// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/time/duration.h"
#include "ftcs/time/instant.h"

namespace ftcs::platform {

/// Event messages that were sent and whose transmit timestamps are awaited.
///
/// A stamp comes back with a copy of its packet and is matched by content: by what of the PTP
/// header cannot change on the way out. So a stamp that comes after its timeout is still that of
/// its own message and never taken for the next one's. The kernel's counter of packets is not
/// needed.
class TransmissionLog {
 public:
  /// A message that was remembered; `bytes` is valid until the log is used again.
  struct Entry {
    std::span<const std::uint8_t> bytes;
    bool was_expired = false;  ///< expire() has reported it before
  };

  void remember(std::span<const std::uint8_t> message, FreeRunningTime now) noexcept;
  /// The message that `packet` holds behind the headers of lower layers; it is forgotten.
  [[nodiscard]] std::optional<Entry> match(std::span<const std::uint8_t> packet) noexcept;
  /// The next message that was sent `timeout` or longer before `now`; each is reported once.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> expire(FreeRunningTime now,
                                                                    Duration timeout) noexcept;
  /// When the oldest message that has neither been matched nor expired was sent.
  [[nodiscard]] std::optional<FreeRunningTime> oldest() const noexcept;

 private:
  static constexpr std::size_t kCapacity =
      16;  // more than can be under way within any sane timeout
  static constexpr std::size_t kLongest =
      128;  // the longest event message, Pdelay_Resp, has 54 octets

  struct Slot {
    std::array<std::uint8_t, kLongest> bytes{};
    std::size_t length = 0;  // 0: free
    FreeRunningTime sent_at{};
    bool expired = false;
    [[nodiscard]] std::span<const std::uint8_t> view() const noexcept {
      return {bytes.data(), length};
    }
  };

  std::array<Slot, kCapacity> slots_{};
  std::size_t next_ = 0;
};

}  // namespace ftcs::platform
