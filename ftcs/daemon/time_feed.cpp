// SPDX-License-Identifier: MIT
#include "ftcs/daemon/time_feed.h"

#include <cmath>
#include <utility>

#include "ftcs/ptp/wire/message.h"
#include "ftcs/time/duration.h"
#include "ftcs/time/relabel.h"

namespace ftcs::daemon {
namespace {

/// How far the steered clock may be from the reference, at one standard deviation: the servo's own
/// word, or what the perceived offsets scatter since lock.
double sigma_s(const FollowerRecord& record) {
  const double own_ns = record.discipline().latest().servo.offset_sigma_ns;
  const double ns = std::isfinite(own_ns) ? own_ns : record.offset_rms_ns();
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

TimeFeed::TimeFeed(platform::Kernel& kernel, Log& log, UtcConfig utc)
    : kernel_(kernel), log_(log), utc_(kernel, log, "samples for NTP", std::move(utc), true) {}

Result<TimeFeed, std::string> TimeFeed::open(platform::Kernel& kernel, const PtpOptions& options,
                                             Log& log) {
  UtcConfig utc;
  utc.utc_offset = options.transmitter.utc_offset;
  utc.epoch = options.follower.epoch;
  const bool wanted = !options.feeds.chrony_socket.empty() || options.feeds.ntp_shm_unit;
  if (wanted && !options.clock.leap_file.empty()) {
    auto list = LeapSeconds::read_file(options.clock.leap_file);
    if (!list) return list.error();
    utc.leap_seconds = std::move(*list);
  }
  TimeFeed feed(kernel, log, std::move(utc));
  if (!options.feeds.chrony_socket.empty()) {
    auto socket = platform::ChronySocket::open(options.feeds.chrony_socket);
    if (!socket) return "--chrony-sock: " + socket.error().message();
    feed.socket_.emplace(std::move(*socket));
  }
  if (options.feeds.ntp_shm_unit) {
    auto shm = platform::NtpShm::open(*options.feeds.ntp_shm_unit);
    if (!shm) return "--ntp-shm: " + shm.error().message();
    feed.shm_.emplace(std::move(*shm));
  }
  return feed;
}

void TimeFeed::set_scale(const ReferenceScale& scale) {
  if (!is_on()) return;
  utc_.on_announced(scale, utc_s_.value_or(kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond));
}

void TimeFeed::publish(const FollowerRecord& record, LocalTime local, FreeRunningTime event,
                       std::int64_t realtime_ns) {
  const std::uint64_t used = record.discipline().counters().used;
  if (!record.locked() || used == std::exchange(told_, used)) return;
  const auto reference = relabel<ReferenceTime>(local);
  if (!utc_.admits(reference, event, realtime_ns)) return;
  const node::UtcFollower& utc = utc_.follower();
  utc_s_ = reference.since_epoch().floor_ns() / kNsPerSecond - utc.utc_offset();
  utc_.on_time(*utc_s_);
  platform::NtpSample sample;
  sample.system_ns = realtime_ns;
  sample.behind = reference.since_epoch() - Duration::from_whole_ns(realtime_ns) -
                  Duration{std::chrono::seconds{utc.utc_offset()}};
  sample.leap = utc.expected_leap();
  sample.sigma_s = sigma_s(record);
  send(sample);
}

void TimeFeed::send(const platform::NtpSample& sample) {
  if (shm_) shm_->write(sample);
  if (!socket_) return;
  const auto error = socket_->send(sample);
  if (error && !refused_) {
    log_(LogLevel::kWarning, "chrony: {} (refclock SOCK of that path in chrony.conf?)",
         error->message());
  } else if (!error && refused_) {
    log_(LogLevel::kNotice, "chrony: takes samples again");
  }
  refused_ = error.has_value();
}

}  // namespace ftcs::daemon
