// SPDX-License-Identifier: MIT
#include "ftcs/daemon/watch/watch_json.h"

#include <cmath>

#include <fmt/format.h>

#include "ftcs/report/json.h"

namespace ftcs::daemon {
namespace {

Json curve(const std::vector<StabilityPoint>& points) {
  Json list = Json::array();
  for (const StabilityPoint& point : points) {
    list.push_back(Json::array({number(point.tau_s), number(point.deviation)}));
  }
  return list;
}

Json to_json(const WatchedCycle& cycle) {
  if (!cycle.present) return {};
  Json drives = Json::array();
  for (std::size_t i = 0; i < cycle.drives && i < WatchedCycle::kDrives; ++i) {
    drives.push_back(
        Json::array({cycle.drive[i].state, number(static_cast<double>(cycle.drive[i].margin_us))}));
  }
  return {{"phase_ns", number(cycle.phase_ns)},
          {"margin_ns", number(cycle.margin_ns)},
          {"working_counter", cycle.working_counter},
          {"expected_counter", cycle.expected_counter},
          {"lost", cycle.lost},
          {"late", cycle.late},
          {"drives", std::move(drives)}};
}

std::string figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string("null");
}

}  // namespace

std::string state_json(const WatchState& state, const WatchHistogram& histogram,
                       const std::vector<StabilityPoint>& adev,
                       const std::vector<StabilityPoint>& tdev) {
  const Json json{{"program", "ftcs"},
                  {"version", FTCS_VERSION},
                  {"kind", std::string(state.kind.view())},
                  {"target", std::string(state.target.view())},
                  {"servo", std::string(state.servo.view())},
                  {"reference", std::string(state.reference.view())},
                  {"mode", std::string(name(state.mode))},
                  {"cause", std::string(diagnosis::name(state.cause))},
                  {"sentence", std::string(state.sentence.view())},
                  {"uptime_s", number(state.uptime_s)},
                  {"offset_ns", number(measured_offset_ns(state))},
                  {"sigma_ns", number(state.sigma_ns)},
                  {"bound_ns", number(offset_bound_ns(state))},
                  {"rate_ppb", number(state.rate_ppb)},
                  {"delay_ns", number(state.delay_ns)},
                  {"used", state.used},
                  {"refused",
                   {{"outlier", state.outliers},
                    {"duplicate", state.duplicates},
                    {"implausible", state.implausible}}},
                  {"steps", state.steps},
                  {"holdovers", state.holdovers},
                  {"cycle", to_json(state.cycle)},
                  {"histogram",
                   {{"lowest_ns", number(histogram.lowest_ns)},
                    {"width_ns", number(histogram.width_ns)},
                    {"counts", histogram.counts}}},
                  {"adev", curve(adev)},
                  {"tdev", curve(tdev)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string points_json(std::span<const WatchPoint> points) {
  std::string text = "[";
  for (const WatchPoint& point : points) {
    if (text.size() > 1) text += ',';
    text += fmt::format("[{:.3f},{},{},{},{},{}]", point.time_s, figure(point.offset_ns),
                        figure(point.sigma_ns), figure(point.rate_ppb), figure(point.delay_ns),
                        point.used ? 1 : 0);
  }
  return text + "]";
}

}  // namespace ftcs::daemon
