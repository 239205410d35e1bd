// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/contour_live.h"

#include <fmt/format.h>

#include "ftcs/fieldbus/cycle_laws.h"
#include "ftcs/fieldbus/local_segment.h"
#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/fieldbus/run_report.h"

namespace ftcs::daemon {

namespace {

constexpr std::size_t kDrives = 2;
constexpr int kSegmentPriority = 70;
constexpr double kReferencePpm = 100.0;  // through SYNC0 within five seconds if nobody follows
constexpr double kOtherPpm = -80.0;
constexpr double kSeconds = 12.0;
constexpr Nanoseconds kGate{500'000};
constexpr std::uint32_t kDriftPulses = 3000;
/// The segment is a thread of a shared machine, which may stand still for a while.
constexpr std::uint32_t kLostFrames = 500;

struct Way {
  const char* title;
  const char* law;
};

RunOptions options_for(const Way& way, std::uint16_t port) {
  const experiment::ContourWorld world;
  RunOptions options;
  options.port = port;
  options.drives = kDrives;
  options.servo.largest_lateness = options.servo.largest_round_trip = kGate;
  options.drift_pulses = kDriftPulses;
  options.duration_s = kSeconds;
  options.quiet = true;
  options.radius = world.radius_um;
  options.turn_s = world.turn_s;
  options.contour = true;
  options.lost_frame_limit = kLostFrames;
  options.sync_error_limit = 0;  // they shall go on, and be counted
  set_cycle_law(options, way.law);
  return options;
}

}  // namespace

std::optional<std::vector<experiment::ContourRow>> run_live_contours(
    platform::Kernel& kernel, const std::function<bool()>& stop) {
  std::vector<experiment::ContourRow> rows;
  SegmentOptions segment_options;
  segment_options.drives = kDrives;
  segment_options.ppm = {kReferencePpm, kOtherPpm};
  for (const Way way : {Way{"no sync", "none"}, Way{"PICS", "pics"}, Way{"FTCS", "ftcs"},
                        Way{"adaptive", "adaptive"}}) {
    if (stop()) break;
    auto segment = LocalSegment::start(kernel, segment_options, kSegmentPriority);
    if (!segment) {
      fmt::print(stderr, "ftcs paper: {}\n", segment.error().message());
      return std::nullopt;
    }
    const RunOptions options = options_for(way, (*segment)->port());
    auto link = platform::EthercatLink::connect_udp(kernel, options.host, options.port);
    if (!link) {
      fmt::print(stderr, "ftcs paper: {}\n", link.error().message());
      return std::nullopt;
    }
    static_cast<void>(platform::make_realtime(options.priority, options.cpu));
    MainRunner runner(options, std::move(*link));
    const bool up = runner.bring_up(stop, false);
    if (up) runner.run(stop);
    platform::leave_realtime();
    (*segment)->stop();
    if (!up) {
      fmt::print(stderr, "ftcs paper: EtherCAT: {}\n", describe(runner.main().failure()));
      return std::nullopt;
    }
    experiment::ContourRow row;
    row.servo = way.title;
    row.rms_um = runner.figures().contour.rms();
    row.max_um = runner.figures().contour.max_absolute();
    row.trace_um = runner.figures().contour_trace;
    if (runner.main().failure()) row.ended = describe(runner.main().failure());
    row.late_windows = kDrives * runner.figures().late_windows;
    for (std::size_t n = 0; n < kDrives; ++n) {
      const auto& sync = (*segment)->server().segment()[n].drive().statistics();
      row.missed_windows += sync.missed;
      row.windows += sync.events;
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace ftcs::daemon
