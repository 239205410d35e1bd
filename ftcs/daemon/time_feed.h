// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "ftcs/daemon/follower_record.h"
#include "ftcs/daemon/log.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/daemon/utc_watch.h"
#include "ftcs/platform/ntp_feed.h"
#include "ftcs/platform/timestamp_clock.h"

namespace ftcs::daemon {

/// Tells an NTP program on this machine (chrony, ntpd) how far the system clock is from the
/// steered one, whenever a sample was used while locked: the reference as our servo filtered it,
/// not the raw samples.
class TimeFeed {
 public:
  /// The error is one line for the user.
  [[nodiscard]] static Result<TimeFeed, std::string> open(platform::Kernel& kernel,
                                                          const PtpOptions& options, Log& log);

  /// Each announcement of the reference once; what is not believed of it (node::UtcFollower) is not
  /// passed on.
  void set_scale(const ReferenceScale& scale);
  /// The steered clock, an oscillator that nobody steers and CLOCK_REALTIME at the same instant.
  void publish(const FollowerRecord& record, LocalTime local, FreeRunningTime event,
               std::int64_t realtime_ns);
  [[nodiscard]] bool is_on() const { return socket_.has_value() || shm_.has_value(); }

 private:
  TimeFeed(platform::Kernel& kernel, Log& log, UtcConfig utc);
  void send(const platform::NtpSample& sample);

  platform::Kernel& kernel_;
  Log& log_;
  UtcWatch utc_;
  std::optional<std::int64_t> utc_s_{};  ///< as last published: the system clock may be wrong
  std::optional<platform::ChronySocket> socket_{};
  std::optional<platform::NtpShm> shm_{};
  std::uint64_t told_ = 0;  ///< samples used so far
  bool refused_ = false;
};

/// What an Announce or a timePropertiesDS says: its flags and UTC offset.
[[nodiscard]] ReferenceScale reference_scale(std::uint16_t flags, int utc_offset);

}  // namespace ftcs::daemon
