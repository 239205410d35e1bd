// SPDX-License-Identifier: MIT
#include "apps/ftcs/time_feed.h"

#include <cmath>
#include <utility>

#include "ftcs/ptp/wire/message.h"

namespace ftcs::app {
namespace {

/// How far the steered clock may be from the reference, at one standard deviation: the servo's own
/// word, or what the perceived offsets scatter since lock.
double sigma_s(const ClockFollower& follower) {
  const double own_ns = follower.discipline().latest().servo.offset_sigma_ns;
  const double ns = std::isfinite(own_ns) ? own_ns : follower.offset_rms_ns();
  return ns * 1e-9;
}

}  // namespace

ReferenceScale reference_scale(std::uint16_t flags, int utc_offset) {
  const auto has = [flags](std::uint16_t mask) { return (flags & mask) != 0; };
  ReferenceScale scale;
  scale.tai = has(ptp::flag::kPtpTimescale);
  if (has(ptp::flag::kUtcOffsetValid)) scale.utc_offset = utc_offset;
  scale.leap = (has(ptp::flag::kLeap61) ? 1 : 0) - (has(ptp::flag::kLeap59) ? 1 : 0);
  return scale;
}

Result<TimeFeed, std::string> TimeFeed::open(const PtpOptions& options) {
  TimeFeed feed(options.utc_offset);
  const bool wanted = !options.chrony_socket.empty() || options.ntp_shm_unit;
  if (wanted && !options.leap_file.empty()) {
    auto list = LeapSeconds::read_file(options.leap_file);
    if (!list) return list.error();
    feed.leap_seconds_ = std::move(*list);
  }
  if (!options.chrony_socket.empty()) {
    auto socket = platform::ChronySocket::open(options.chrony_socket);
    if (!socket) return "--chrony-sock: " + socket.error().message();
    feed.socket_.emplace(std::move(*socket));
  }
  if (options.ntp_shm_unit) {
    auto shm = platform::NtpShm::open(*options.ntp_shm_unit);
    if (!shm) return "--ntp-shm: " + shm.error().message();
    feed.shm_.emplace(std::move(*shm));
  }
  return feed;
}

LeapSeconds::State TimeFeed::utc_at(std::int64_t local_s) const {
  LeapSeconds::State utc{scale_.tai ? scale_.utc_offset.value_or(utc_offset_) : 0, scale_.leap};
  if (!scale_.tai || !leap_seconds_) return utc;
  const auto listed = leap_seconds_->at(local_s - utc.utc_offset);
  if (!listed) return utc;
  if (!scale_.utc_offset) utc.utc_offset = listed->utc_offset;
  if (utc.leap == 0) utc.leap = listed->leap;
  return utc;
}

void TimeFeed::publish(const ClockFollower& follower, LocalTime local, std::int64_t realtime_ns,
                       Log& log) {
  const std::uint64_t used = follower.discipline().counters().used;
  if (!follower.locked() || used == std::exchange(told_, used)) return;
  const LeapSeconds::State utc = utc_at(local.since_epoch().rounded_ns() / 1'000'000'000);
  platform::NtpSample sample;
  sample.system_ns = realtime_ns;
  sample.behind = local.since_epoch() - Duration::from_whole_ns(realtime_ns) -
                  Duration{std::chrono::seconds{utc.utc_offset}};
  sample.leap = utc.leap;
  sample.sigma_s = sigma_s(follower);
  if (shm_) shm_->write(sample);
  if (!socket_) return;
  const auto error = socket_->send(sample);
  if (error && !refused_) {
    log(LogLevel::kWarning, "chrony: {} (refclock SOCK of that path in chrony.conf?)",
        error->message());
  } else if (!error && refused_) {
    log(LogLevel::kNotice, "chrony: takes samples again");
  }
  refused_ = error.has_value();
}

}  // namespace ftcs::app
