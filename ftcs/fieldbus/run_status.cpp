// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/run_status.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "ftcs/daemon/management_server.h"
#include "ftcs/fieldbus/run_report.h"
#include "ftcs/report/json.h"

namespace ftcs::daemon {

namespace {

constexpr int kTurnMs = 250;

std::span<const std::uint8_t> octets(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Json plant_json(const RunOptions& options, const BusClockDecision& bus) {
  if (options.plant_time.empty()) return nullptr;
  return {{"source", options.plant_time},
          {"mode", name(options.bus_mode)},
          {"state", ftcs::name(bus.state)},
          {"dc_to_plant_ns", bus.known ? Json(bus.dc_to_plant.ns()) : Json(nullptr)},
          {"dc_to_plant_sigma_ns", bus.known ? Json(bus.sigma_ns) : Json(nullptr)},
          {"bus_rate_ppb", bus.rate_ppb}};
}

Json diagnosis_json(const diagnosis::CycleSeen& seen) {
  constexpr std::size_t kLongest = 480;
  std::array<char, kLongest> text{};
  const diagnosis::Finding finding = diagnosis::diagnose(seen);
  return {{"cause", std::string(diagnosis::name(finding.cause))},
          {"sentence", std::string(diagnosis::write_sentence(text, seen))},
          {"seen", finding.seen},
          {"expected", finding.expected},
          {"remedy", finding.remedy}};
}

}  // namespace

RunSnapshot RunSnapshot::of(const node::CycleNode& node, const diagnosis::CycleSeen& seen) {
  RunSnapshot result;
  const ethercat::CycleReport& report = node.main().last_cycle();
  result.state = node.decision().state;
  result.bus = node.bus();
  result.cycles = node.servo().counters().cycles;
  result.lost_frames = node.main().counters().lost;
  result.phase_ns = node.decision().phase_error.ns();
  result.rate_ppb = node.decision().rate.ppb();
  result.margin_ns = seen.margin_ns;
  result.seen = seen;
  result.working_counter = report.working_counter;
  result.expected = report.expected;
  result.all_operational = report.all_operational();
  result.drives = node.main().network().count;
  for (std::size_t n = 0; n < result.drives; ++n) result.clocks[n] = node.clocks()[n];
  return result;
}

std::string run_status(const RunOptions& options, const RunSnapshot& snapshot) {
  Json clocks = Json::array();
  for (std::size_t n = 0; n < snapshot.drives; ++n) {
    clocks.push_back(
        {{"system_time_difference_ns", difference_json(snapshot.clocks[n])},
         {"largest_difference_ns",
          snapshot.clocks[n].readings > 0 ? Json(snapshot.clocks[n].largest) : Json(nullptr)},
         {"differences_beyond_limit", snapshot.clocks[n].beyond}});
  }
  const Json status{
      {"interface", options.interface.empty() ? fmt::format("udp {}:{}", options.host, options.port)
                                              : options.interface},
      {"role", "ethercat"},
      {"servo", options.servo_name},
      {"state", name(snapshot.state)},
      {"diagnosis", diagnosis_json(snapshot.seen)},
      {"locked", snapshot.state == CycleState::kLocked},
      {"all_operational", snapshot.all_operational},
      {"cycles", snapshot.cycles},
      {"cycle_ns", options.servo.cycle.count()},
      {"phase_ns", snapshot.phase_ns},
      {"rate_ppb", snapshot.rate_ppb},
      {"margin_ns", snapshot.margin_ns},
      {"working_counter", snapshot.working_counter},
      {"working_counter_expected", snapshot.expected},
      {"axes_in_fault", snapshot.seen.axes_in_fault},
      {"lost_frames", snapshot.lost_frames},
      {"plant_time", plant_json(options, snapshot.bus)},
      {"drives", std::move(clocks)}};
  return dump(status);
}

RunStatus::RunStatus(const RunOptions& options, platform::LocalSocket socket)
    : options_(options), socket_(std::move(socket)), thread_([this] { serve(); }) {}

Result<std::unique_ptr<RunStatus>, platform::OsError> RunStatus::open(const RunOptions& options) {
  auto socket = platform::LocalSocket::bind(options.status_socket);
  if (!socket) return socket.error();
  return std::unique_ptr<RunStatus>(new RunStatus(options, std::move(*socket)));
}

RunStatus::~RunStatus() {
  stop_ = true;
  thread_.join();
}

void RunStatus::serve() {
  while (!stop_) {
    socket_.wait(kTurnMs);
    const auto request = socket_.receive();
    if (!request || request->sender.empty()) continue;
    const bool asked = std::ranges::equal(
        request->bytes.first(std::min(request->bytes.size(), kStatusQuery.size())),
        octets(kStatusQuery));
    if (!asked) continue;
    RunSnapshot snapshot;
    {
      const std::lock_guard lock(guard_);
      snapshot = snapshot_;
    }
    (void)socket_.send(request->sender, octets(run_status(options_, snapshot)));
  }
}

}  // namespace ftcs::daemon
