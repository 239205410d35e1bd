// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/run_report.h"

#include <fmt/format.h>

#include "ftcs/fieldbus/run_histograms.h"
#include "ftcs/report/json.h"

namespace ftcs::daemon {

Json difference_json(const node::DriveClocks::Seen& clock) {
  return clock.last ? Json(*clock.last) : Json(nullptr);
}

namespace {

using ethercat::FailureKind;

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

void print_quantiles(const char* title, const QuantileSketch& sketch, bool absolute) {
  const auto at = [&](double fraction) {
    return 1e-3 * (absolute ? sketch.absolute_quantile(fraction) : sketch.quantile(fraction));
  };
  if (sketch.count() == 0) return fmt::print("{:<28} not judged\n", title);
  fmt::print("{:<28} p50 {:9.3f}  p90 {:9.3f}  p99 {:9.3f}  p99.9 {:9.3f}  max {:9.3f} us\n", title,
             at(0.5), at(0.9), at(0.99), at(0.999), at(1.0));
}

Json quantiles(const QuantileSketch& sketch, bool absolute) {
  const auto at = [&](double fraction) {
    return absolute ? sketch.absolute_quantile(fraction) : sketch.quantile(fraction);
  };
  if (sketch.count() == 0) return nullptr;
  return Json{{"p50_ns", at(0.5)},     {"p90_ns", at(0.9)}, {"p99_ns", at(0.99)},
              {"p99_9_ns", at(0.999)}, {"max_ns", at(1.0)}, {"count", sketch.count()}};
}

Json drives_json(const MainRunner& runner) {
  Json drives = Json::array();
  for (const ethercat::SubDeviceInfo& device : runner.main().network().all()) {
    const node::DriveClocks::Seen& clock = runner.clocks()[drives.size()];
    drives.push_back(
        Json{{"station", device.station},
             {"name", device.sii.device_name.data()},
             {"state", ethercat::name(device.state)},
             {"al_status_code", static_cast<unsigned>(device.code)},
             {"al_status", ethercat::name(device.code)},
             {"propagation_delay_ns", device.propagation_delay},
             {"system_time_difference_ns", difference_json(clock)},
             {"largest_difference_ns", clock.readings > 0 ? Json(clock.largest) : Json(nullptr)},
             {"differences_beyond_limit", clock.beyond}});
  }
  return drives;
}

constexpr std::pair<const char*, float experiment::CyclePoint::*> kHistograms[] = {
    {"margin", &experiment::CyclePoint::margin_us},
    {"phase", &experiment::CyclePoint::phase_us},
    {"lateness", &experiment::CyclePoint::lateness_us},
    {"round_trip", &experiment::CyclePoint::round_trip_us}};

Json histograms_json(const experiment::CycleFigures& figures) {
  Json result = Json::object();
  for (const auto& [name, field] : kHistograms) {
    const Histogram bins = run_histogram(figures, field);
    if (bins.counts.empty()) continue;
    result[name] = {{"lower_us", bins.lower},
                    {"upper_us", bins.upper},
                    {"counts", bins.counts},
                    {"outside", bins.below + bins.above}};
  }
  return result;
}

void print_histograms(const experiment::CycleFigures& figures) {
  for (const auto& [name, field] : kHistograms) {
    const Histogram bins = run_histogram(figures, field);
    if (bins.counts.empty()) continue;
    fmt::print("{:<10} {:9.3f} |{}| {:9.3f} us, {} outside\n", name, bins.lower,
               histogram_bars(bins), bins.upper, bins.below + bins.above);
  }
}

Json events_json(const experiment::CycleFigures& figures) {
  Json events = Json::array();
  for (const experiment::CycleEvent& event : figures.events) {
    Json entry{{"time_s", event.time_s}, {"event", name(event.note.kind)}};
    if (event.note.drive != node::CycleNote::kNobody) entry["drive"] = event.note.drive;
    if (event.note.code != ethercat::AlStatusCode::kNoError) {
      entry["al_status_code"] = static_cast<unsigned>(event.note.code);
      entry["al_status"] = ethercat::name(event.note.code);
    }
    events.push_back(entry);
  }
  return events;
}

void print_events(const experiment::CycleFigures& figures) {
  constexpr std::size_t kMostLines = 40;
  std::size_t lines = 0;
  for (const experiment::CycleEvent& event : figures.events) {
    if (++lines > kMostLines) {
      fmt::print("... {} more events (--json has them)\n", figures.events.size() - kMostLines);
      return;
    }
    fmt::print("{:9.3f} s  ", event.time_s);
    if (event.note.drive != node::CycleNote::kNobody) fmt::print("drive {}: ", event.note.drive);
    fmt::print("{}", name(event.note.kind));
    if (event.note.code != ethercat::AlStatusCode::kNoError) {
      fmt::print(", AL status code 0x{:04X}: {}", static_cast<unsigned>(event.note.code),
                 ethercat::name(event.note.code));
    }
    fmt::print("\n");
  }
}

/// |0x092C| of each drive, and who was beyond the limit.
void print_clocks(const MainRunner& runner) {
  fmt::print("|0x092C| of each drive, largest:");
  for (std::size_t n = 0; n < runner.main().network().count; ++n) {
    const node::DriveClocks::Seen& clock = runner.clocks()[n];
    fmt::print(" {}", clock.readings > 0 ? fmt::to_string(clock.largest) : "-");
  }
  fmt::print(" ns\n");
  for (std::size_t n = 0; n < runner.main().network().count; ++n) {
    const node::DriveClocks::Seen& clock = runner.clocks()[n];
    if (clock.beyond == 0) continue;
    fmt::print("drive {}: beyond {} ns in {} of {} readings\n", n,
               runner.options().difference_limit.count(), clock.beyond, clock.readings);
  }
}

Json bus_json(const MainRunner& runner) {
  const BusClockDecision& bus = runner.bus();
  return {{"mode", name(runner.options().bus_mode)},
          {"plant_time", runner.options().plant_time},
          {"state", ftcs::name(bus.state)},
          {"dc_to_plant_ns", bus.known ? Json(bus.dc_to_plant.ns()) : Json(nullptr)},
          {"dc_to_plant_sigma_ns", bus.known ? Json(bus.sigma_ns) : Json(nullptr)},
          {"bus_rate_ppb", bus.rate_ppb}};
}

std::string describe(const ethercat::Identity& identity) {
  return fmt::format("vendor 0x{:08X}, product 0x{:08X}, revision 0x{:08X}, serial {}",
                     identity.vendor, identity.product, identity.revision, identity.serial);
}

}  // namespace

const char* name(node::BusMode mode) {
  if (mode == node::BusMode::kLead) return "lead";
  return mode == node::BusMode::kExternal ? "external" : "follow";
}

const char* name(CycleState state) {
  switch (state) {
    case CycleState::kWaiting:
      return "waiting";
    case CycleState::kAcquiring:
      return "acquiring";
    case CycleState::kLocked:
      return "locked";
    case CycleState::kCoasting:
      return "coasting";
  }
  return "unknown";
}

const char* name(node::CycleNote::Kind kind) {
  switch (kind) {
    case node::CycleNote::Kind::kLocked:
      return "locked";
    case node::CycleNote::Kind::kLockLost:
      return "lock lost";
    case node::CycleNote::Kind::kOpRequested:
      return "OP asked for";
    case node::CycleNote::Kind::kLeftOp:
      return "left OP";
    case node::CycleNote::Kind::kOutOfReach:
      return "does not answer to its address";
    case node::CycleNote::Kind::kReintegrated:
      return "restarted: configured again";
    case node::CycleNote::Kind::kBackInOp:
      return "back in OP";
    case node::CycleNote::Kind::kAxisFault:
      return "axis in fault";
    case node::CycleNote::Kind::kFaultReset:
      return "axis fault reset";
    case node::CycleNote::Kind::kBusLocked:
      return "bus on plant time";
    case node::CycleNote::Kind::kBusLockLost:
      return "bus off plant time";
    case node::CycleNote::Kind::kPlantTimeLost:
      return "plant time lost, bus in holdover";
    case node::CycleNote::Kind::kPlantTimeBack:
      return "plant time back";
    case node::CycleNote::Kind::kDriveClockOff:
      return "clock off the reference's";
    case node::CycleNote::Kind::kDriveClockBack:
      return "clock back at the reference's";
  }
  return "unknown";
}

std::string describe(const ethercat::Failure& failure) {
  std::string text = ethercat::name(failure.kind);
  if (failure.position != ethercat::Failure::kNobody) {
    text = fmt::format("SubDevice {}: {}", failure.position, text);
  }
  switch (failure.kind) {
    case FailureKind::kTooManySubDevices:
    case FailureKind::kFewerThanConfigured:
    case FailureKind::kWorkingCounter:
    case FailureKind::kProcessImageTooLarge:
    case FailureKind::kNotStopped:
      return fmt::format("{} (expected {}, found {})", text, failure.expected, failure.received);
    case FailureKind::kStateRefused:
    case FailureKind::kStateTimeout:
      return fmt::format("{} (wanted {}, is in {}, AL status code 0x{:04X}: {})", text,
                         ethercat::name(failure.wanted), ethercat::name(failure.actual),
                         static_cast<unsigned>(failure.code), ethercat::name(failure.code));
    case FailureKind::kSdoAborted:
    case FailureKind::kSdoTimeout:
    case FailureKind::kSdoMalformed:
      return fmt::format("{} (object 0x{:04X}:{:02X}, {})", text, failure.object.index,
                         failure.object.subindex, ethercat::name(failure.abort));
    case FailureKind::kReplaced:
      return fmt::format("{} (expected {}; found {})", text, describe(failure.known),
                         describe(failure.found));
    case FailureKind::kMailboxUnusable:
      return failure.received < failure.expected
                 ? fmt::format("{} ({} octets, an SDO needs {})", text, failure.received,
                               failure.expected)
                 : fmt::format("{} ({} octets, a frame holds {})", text, failure.received,
                               failure.expected);
    case FailureKind::kInOperation:
    case FailureKind::kInUse:
      return text + " (stop it, or take them over with --take-over)";
    case FailureKind::kBadSii:
      return fmt::format("{} ({})", text, ethercat::name(failure.sii));
    case FailureKind::kNoDistributedClock:
      return text + ": there is nothing to put on plant time";
    case FailureKind::kLinkLost:
      return fmt::format("{} ({} in a row)", text, failure.received);
    default:
      return text;
  }
}

void print_scan(const ethercat::MainDevice& main) {
  const ethercat::Network& network = main.network();
  fmt::print("{} SubDevices\n", network.count);
  for (std::size_t n = 0; n < network.count; ++n) {
    const ethercat::SubDeviceInfo& device = network.devices[n];
    const ethercat::Identity& identity = device.sii.identity;
    std::string ports;
    for (unsigned port = 0; port < ethercat::reg::kPorts; ++port) {
      ports += device.links.open(port) ? static_cast<char>('0' + port) : '-';
    }
    fmt::print(
        "{:3}  0x{:04X}  {:<28} vendor 0x{:08X}  product 0x{:08X}  revision 0x{:08X}  "
        "serial {}\n",
        n, device.station, device.sii.device_name.data(), identity.vendor, identity.product,
        identity.revision, identity.serial);
    fmt::print("     state {}  alias {}  ports {}  parent {}  mailbox {}  clock {}  delay {} ns\n",
               ethercat::name(device.state), device.alias, ports,
               device.parent < 0 ? "MainDevice"
                                 : fmt::format("{} port {}", device.parent, device.parent_port),
               device.sii.coe() ? "CoE" : "none",
               device.dc64() ? "64 bit" : (device.dc() ? "32 bit" : "none"),
               device.propagation_delay);
  }
}

void print_run(const MainRunner& runner) {
  const experiment::CycleFigures& figures = runner.figures();
  const CycleServoCounters& servo = runner.servo_counters();
  const ethercat::CycleCounters& counters = runner.main().counters();
  fmt::print("\nservo {}, cycle {} us, {} cycles; locked in cycle {}, OP in cycle {}\n",
             runner.options().servo_name,
             static_cast<double>(runner.options().servo.cycle.count()) * 1e-3, figures.cycles,
             figures.lock_cycle, figures.op_cycle);
  if (figures.lock.losses() > 0) {
    fmt::print("lock lost {} times; longest way back {} cycles\n", figures.lock.losses(),
               figures.lock.longest_relock());
  }
  print_events(figures);
  fmt::print(
      "working counter right in {} of {} cycles; lost frames {}; cycles that a stall of the "
      "host passed over {}\n",
      figures.working_counter_right, figures.cycles, counters.lost, figures.host_stalls);
  fmt::print(
      "after the lock: {} cycles judged, {} excluded ({:.2f} %: later or slower than the "
      "gates)\n",
      figures.judged, figures.excluded,
      100.0 * share(figures.excluded, figures.judged + figures.excluded));
  print_quantiles("|phase| of the virtual cycle", figures.phase, true);
  print_quantiles("|phase| of the frame itself", figures.wire_phase, true);
  print_quantiles("lateness", figures.lateness, false);
  print_quantiles("round trip", figures.round_trip, false);
  print_quantiles("margin to SYNC0", figures.margin, false);
  print_histograms(figures);
  if (figures.worst_difference_ns) {
    fmt::print("|0x092C| from one second after the lock: under {} ns (bound)\n",
               *figures.worst_difference_ns + 1);
    print_clocks(runner);
  } else {
    fmt::print("|0x092C|: not judged, there was no cycle a second after the lock\n");
  }
  fmt::print("rate {:+.3f} ppm; resyncs {}, impossible {}, doubtful stamps {}\n",
             runner.decision().rate.ppm(), servo.resyncs, servo.impossible, servo.doubtful);
  if (!runner.options().plant_time.empty()) {
    fmt::print("bus: {} on {}, {}; dc to plant {:+.3f} us, sigma {:.3f} us; bent by {:+.3f} ppm\n",
               name(runner.options().bus_mode), runner.options().plant_time,
               ftcs::name(runner.bus().state), runner.bus().dc_to_plant.ns() * 1e-3,
               runner.bus().sigma_ns * 1e-3, runner.bus().rate_ppb * 1e-3);
  }
  if (runner.options().servo.law == CycleLaw::kPics &&
      runner.options().servo.proportional_gain == 1.0 &&
      runner.options().servo.integral_gain == 1.0) {
    fmt::print(
        "PICS with normalised gains (1, 1) is deadbeat: it equals FTCS with p = 1, which "
        "needs no gain.\n");
  }
}

Json run_json(const MainRunner& runner) {
  const experiment::CycleFigures& figures = runner.figures();
  const CycleServoCounters& servo = runner.servo_counters();
  Json json{{"servo", runner.options().servo_name},
            {"cycle_ns", runner.options().servo.cycle.count()},
            {"cycles", figures.cycles},
            {"cycles_per_sync", runner.options().servo.cycles_per_sync},
            {"locked", runner.decision().state == CycleState::kLocked},
            {"lock_cycle", figures.lock_cycle},
            {"lock_losses", figures.lock.losses()},
            {"longest_relock_cycles", figures.lock.longest_relock()},
            {"op_cycle", figures.op_cycle},
            {"working_counter_right", figures.working_counter_right},
            {"lost_frames", runner.main().counters().lost},
            {"host_stall_cycles", figures.host_stalls},
            {"judged", figures.judged},
            {"excluded", figures.excluded},
            {"excluded_share", share(figures.excluded, figures.judged + figures.excluded)},
            {"virtual_phase", quantiles(figures.phase, true)},
            {"wire_phase", quantiles(figures.wire_phase, true)},
            {"virtual_phase_second_half", quantiles(figures.second_half_phase, true)},
            {"wire_phase_second_half", quantiles(figures.second_half_wire_phase, true)},
            {"lateness", quantiles(figures.lateness, false)},
            {"round_trip", quantiles(figures.round_trip, false)},
            {"margin", quantiles(figures.margin, false)},
            {"system_time_difference_bound_ns",
             figures.worst_difference_ns ? Json(*figures.worst_difference_ns) : Json(nullptr)},
            {"rate_ppb", runner.decision().rate.ppb()},
            {"late", servo.late},
            {"slow", servo.slow},
            {"impossible", servo.impossible},
            {"doubtful", servo.doubtful},
            {"resyncs", servo.resyncs},
            {"reintegrated", runner.main().counters().reintegrated},
            {"histograms", histograms_json(figures)},
            {"events", events_json(figures)},
            {"drives", drives_json(runner)}};
  if (!runner.options().plant_time.empty()) json["bus"] = bus_json(runner);
  if (runner.main().failure()) json["failure"] = describe(runner.main().failure());
  return json;
}

std::string run_json_text(const MainRunner& runner) { return dump(run_json(runner)); }

}  // namespace ftcs::daemon
