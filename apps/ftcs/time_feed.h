// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "apps/ftcs/clock_follower.h"
#include "apps/ftcs/leap_seconds.h"
#include "apps/ftcs/log.h"
#include "apps/ftcs/ptp_options.h"
#include "apps/ftcs/real_clock.h"
#include "ftcs/platform/ntp_feed.h"
#include "ftcs/platform/timestamp_clock.h"

namespace ftcs::app {

/// Tells an NTP program on this machine (chrony, ntpd) how far the system clock is from the
/// steered one, whenever a sample was used while locked: the reference as our servo filtered it,
/// not the raw samples.
class TimeFeed {
 public:
  /// The error is one line for the user.
  [[nodiscard]] static Result<TimeFeed, std::string> open(const PtpOptions& options);

  /// The reference's timescale, as soon as it is known.
  void set_scale(const ReferenceScale& scale) { scale_ = scale; }
  /// `reading`: CLOCK_REALTIME and, at the same instant, `local`, the steered clock.
  void publish(const ClockFollower& follower, LocalTime local, std::int64_t realtime_ns, Log& log);
  [[nodiscard]] bool is_on() const { return socket_.has_value() || shm_.has_value(); }

 private:
  explicit TimeFeed(int utc_offset) : utc_offset_(utc_offset) {}
  /// By what the reference vouches for, else by the list, else by `utc_offset_`.
  [[nodiscard]] LeapSeconds::State utc_at(std::int64_t local_s) const;

  int utc_offset_;
  std::optional<LeapSeconds> leap_seconds_{};
  std::optional<platform::ChronySocket> socket_{};
  std::optional<platform::NtpShm> shm_{};
  ReferenceScale scale_{false};
  std::uint64_t told_ = 0;  ///< samples used so far
  bool refused_ = false;
};

/// What an Announce or a timePropertiesDS says: its flags and UTC offset.
[[nodiscard]] ReferenceScale reference_scale(std::uint16_t flags, int utc_offset);

}  // namespace ftcs::app
