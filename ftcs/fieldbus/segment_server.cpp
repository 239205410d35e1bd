// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/segment_server.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fmt/format.h>

#include "ftcs/report/json.h"
#include "ftcs/time/relabel.h"

namespace ftcs::daemon {

namespace {

using ethercat::WireTime;

/// How long the server sleeps without a frame before it looks at signals and watchdogs.
constexpr Nanoseconds kIdle{20'000'000};

/// The host's clock is the time of this wire.
WireTime on_wire(FreeRunningTime time) { return relabel<WireTime>(time); }

double ppm_of(const SegmentOptions& options, std::size_t n) {
  if (options.ppm.empty()) return 0.0;
  if (n < options.ppm.size()) return options.ppm[n];
  // The last two take turns.
  const std::size_t period = std::min<std::size_t>(options.ppm.size(), 2);
  return options.ppm[options.ppm.size() - period + (n - options.ppm.size()) % period];
}

ethercat::Wiring wiring_of(const SegmentOptions& options, std::size_t n) {
  ethercat::Wiring wiring;
  wiring.cable = options.cable;
  wiring.processing = wiring.forwarding = options.hop;
  if (n == 0) return wiring;
  wiring.parent = static_cast<int>(options.tree ? (n - 1) / 3 : n - 1);
  wiring.parent_port = options.tree ? static_cast<unsigned>((n - 1) % 3 + 1) : 1;
  return wiring;
}

/// Every error that the drive raised since it was switched on, restarts included.
Json faults_json(const ethercat::DriveApplication& drive) {
  Json faults = Json::array();
  for (const ethercat::DriveFault& fault : drive.faults()) {
    faults.push_back({{"al_status_code", static_cast<unsigned>(fault.code)},
                      {"al_status", ethercat::name(fault.code)},
                      {"count", fault.count}});
  }
  return faults;
}

}  // namespace

SegmentServer::SegmentServer(platform::Kernel& kernel, const SegmentOptions& options,
                             platform::EthercatLink link)
    : options_(options),
      link_(std::move(link)),
      other_side_(kernel),
      segment_(std::make_unique<ethercat::Segment>()),
      start_(link_.clock().now()),
      random_(options.seed) {
  std::stable_sort(options_.faults.begin(), options_.faults.end(),
                   [](const SegmentFault& a, const SegmentFault& b) { return a.at_s < b.at_s; });
  build();
  if (!options_.clock_csv.empty()) clock_csv_.reset(std::fopen(options_.clock_csv.c_str(), "w"));
}

void SegmentServer::build() {
  for (std::size_t n = 0; n < options_.drives; ++n) {
    sim::OscillatorSpec spec;
    spec.grid = Nanoseconds{100'000'000};
    spec.parts.emplace_back(sim::ConstantSkew{ppm_of(options_, n) * 1e-6});
    if (options_.random_walk_ppb > 0.0) {
      spec.parts.emplace_back(sim::RandomWalkFm{options_.random_walk_ppb * 1e-9});
    }
    crystals_.push_back(
        std::make_unique<sim::SimulatedCrystal>(spec, options_.seed, n, on_wire(start_)));
    static_cast<void>(segment_->add(config_of(n), wiring_of(options_, n), *crystals_.back()));
    segment_->power_cycle(n, on_wire(start_));
  }
}

ethercat::SubDeviceConfig SegmentServer::config_of(std::size_t n) {
  ethercat::SubDeviceConfig config;
  if (n == options_.bridge) {
    config.identity = ethercat::kBridgeIdentity;
    config.other_side = &other_side_;
  }
  config.identity.serial = static_cast<std::uint32_t>(n + 1);
  config.dc = options_.clock_bits > 0;
  config.dc64 = options_.clock_bits == 64;
  // Local clocks that started at different times, as switched-on drives do.
  config.clock.sign_bit_means_ahead = options_.sign_bit_means_ahead;
  config.clock.initial_local = Nanoseconds{1'000'000'007} * static_cast<std::int64_t>(n);
  return config;
}

bool SegmentServer::finished() const {
  if (options_.duration_s <= 0.0) return false;
  return (link_.clock().now() - start_).seconds() > options_.duration_s;
}

void SegmentServer::serve() {
  const auto received = link_.receive(link_.clock().now() + Duration{kIdle}, false);
  if (!received) {
    segment_->advance(on_wire(link_.clock().now()));
    return;
  }
  const auto frame = ethercat::FrameView::parse(received->frame);
  if (!frame) {
    ++malformed_;
    return;
  }
  if (!started_) {
    started_ = true;
    start_ = received->stamp;
  }
  apply_faults(received->stamp);
  ++frames_;
  if (!received->by_kernel) ++user_stamps_;
  random_ = random_ * 6364136223846793005ULL + 1442695040888963407ULL;
  constexpr double kRange = 18446744073709551616.0;
  const double draw = static_cast<double>(random_) / kRange;
  const bool dropped = draw < options_.drop;
  if (draw < options_.drop / 2) {
    ++dropped_;
    return;
  }
  const auto passage = segment_->pass(*frame, on_wire(received->stamp));
  write_clock(received->stamp);
  if (dropped || !passage.returned) {
    ++dropped_;
    return;
  }
  link_.send(received->frame);
}

void SegmentServer::write_clock(FreeRunningTime stamp) {
  constexpr std::uint64_t kEvery = 50;
  if (!clock_csv_ || frames_ % kEvery != 0 || segment_->size() == 0) return;
  const std::uint64_t shown = (*segment_)[0].dc().system_time(on_wire(stamp));
  try {
    fmt::print(clock_csv_.get(), "{},{}\n", stamp.since_epoch().rounded_ns(), shown);
  } catch (const std::system_error& error) {
    end_clock_csv(error.code().value());
  }
}

/// A record that cannot be kept ends no drive.
void SegmentServer::end_clock_csv(int number) {
  fmt::print(stderr, "ftcs ethercat-segment: cannot write {}: {}; the segment goes on without it\n",
             options_.clock_csv, std::generic_category().message(number));
  clock_csv_.reset();
  record_cut_ = true;
}

/// What still lies in its buffer.
bool SegmentServer::finish_records() {
  if (clock_csv_ && std::fflush(clock_csv_.get()) != 0) end_clock_csv(errno);
  return !record_cut_;
}

void SegmentServer::apply_faults(FreeRunningTime now) {
  while (next_fault_ < options_.faults.size() &&
         (now - start_).seconds() >= options_.faults[next_fault_].at_s) {
    apply(options_.faults[next_fault_++], on_wire(now));
  }
}

void SegmentServer::apply(const SegmentFault& fault, WireTime now) {
  if (fault.device >= segment_->size()) return;
  switch (fault.kind) {
    case SegmentFault::Kind::kCut:
      segment_->set_cut(fault.device, true);
      break;
    case SegmentFault::Kind::kMend:
      segment_->set_cut(fault.device, false);
      break;
    case SegmentFault::Kind::kRestart:
      segment_->power_cycle(fault.device, now);
      break;
    case SegmentFault::Kind::kSkew:
      crystals_[fault.device]->skew(fault.ppm, now);
      break;
  }
}

void SegmentServer::print_summary() const {
  fmt::print("frames {}, dropped {}, malformed {}, foreign {}, stamped in user space {}\n", frames_,
             dropped_, malformed_, link_.foreign(), user_stamps_);
  for (std::size_t n = 0; n < segment_->size(); ++n) {
    const ethercat::SubDevice& device = (*segment_)[n];
    const ethercat::SyncStatistics& sync = device.drive().statistics();
    fmt::print("drive {:2}  {:6}  0x{:04X} {}", n, ethercat::name(device.drive().state()),
               static_cast<unsigned>(device.drive().code()), ethercat::name(device.drive().code()));
    if (sync.events > sync.missed) {
      fmt::print("  |0x092C| {} ns  SYNC0 {}  missed {}  margin {:.1f} to {:.1f} us",
                 std::abs(device.system_time_difference()), sync.events, sync.missed,
                 static_cast<double>(sync.smallest_margin_ns) * 1e-3,
                 static_cast<double>(sync.largest_margin_ns) * 1e-3);
    }
    for (const ethercat::DriveFault& fault : device.drive().faults()) {
      fmt::print("  raised 0x{:04X} {} times", static_cast<unsigned>(fault.code), fault.count);
    }
    fmt::print("\n");
  }
}

std::string SegmentServer::json() const {
  Json drives = Json::array();
  for (std::size_t n = 0; n < segment_->size(); ++n) {
    const ethercat::SubDevice& device = (*segment_)[n];
    const ethercat::SyncStatistics& sync = device.drive().statistics();
    Json drive{{"number", n},
               {"state", ethercat::name(device.drive().state())},
               {"al_status_code", static_cast<unsigned>(device.drive().code())},
               {"al_status", ethercat::name(device.drive().code())},
               {"system_time_difference_ns", device.system_time_difference()},
               {"sync0_events", sync.events},
               {"sync0_missed", sync.missed},
               {"faults", faults_json(device.drive())}};
    if (sync.events > sync.missed) {
      drive["margin_min_ns"] = sync.smallest_margin_ns;
      drive["margin_max_ns"] = sync.largest_margin_ns;
      drive["margin_histogram"] = sync.histogram;
    }
    drives.push_back(drive);
  }
  return dump(Json{{"frames", frames_},
                   {"dropped", dropped_},
                   {"malformed", malformed_},
                   {"stamped_in_user_space", user_stamps_},
                   {"drives", drives}});
}

}  // namespace ftcs::daemon
