// SPDX-License-Identifier: MIT
#include "ftcs/report/json.h"

#include <cmath>
#include <optional>

namespace ftcs {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

namespace {

Json or_null(std::optional<std::uint64_t> value) { return value ? Json(*value) : Json(nullptr); }

}  // namespace

Json to_json(const RunningStatistics& statistics, const std::string& unit, double scale) {
  Json json;
  json["count"] = statistics.count();
  json["missing"] = statistics.missing();
  json["mean_" + unit] = statistics.mean() / scale;
  json["standard_deviation_" + unit] = statistics.standard_deviation() / scale;
  json["rms_" + unit] = statistics.rms() / scale;
  json["minimum_" + unit] = statistics.minimum() / scale;
  json["maximum_" + unit] = statistics.maximum() / scale;
  json["max_absolute_" + unit] = statistics.max_absolute() / scale;
  return json;
}

Json to_json(const Summary& summary, const std::string& unit, double scale) {
  Json json = to_json(summary.moments, unit, scale);
  json["median_" + unit] = summary.median / scale;
  json["median_absolute_deviation_" + unit] = summary.median_absolute_deviation / scale;
  json["percentile_1_" + unit] = summary.percentile_1 / scale;
  json["percentile_5_" + unit] = summary.percentile_5 / scale;
  json["percentile_25_" + unit] = summary.percentile_25 / scale;
  json["percentile_75_" + unit] = summary.percentile_75 / scale;
  json["percentile_95_" + unit] = summary.percentile_95 / scale;
  json["percentile_99_" + unit] = summary.percentile_99 / scale;
  json["absolute_percentile_95_" + unit] = summary.absolute_percentile_95 / scale;
  json["absolute_percentile_99_" + unit] = summary.absolute_percentile_99 / scale;
  return json;
}

Json to_json(const Convergence& convergence) {
  Json json;
  json["settled_sample"] = or_null(convergence.settled);
  json["cycles_from_first_message"] =
      or_null(convergence.cycles_to_converge(ConvergenceOrigin::kFirstMessage));
  json["cycles_from_first_action"] =
      or_null(convergence.cycles_to_converge(ConvergenceOrigin::kFirstAction));
  return json;
}

Json to_json(std::span<const StabilityPoint> points) {
  Json json = Json::array();
  for (const StabilityPoint& point : points) {
    json.push_back({{"tau_s", point.tau_s},
                    {"deviation", point.deviation},
                    {"lower", point.lower},
                    {"upper", point.upper},
                    {"terms", point.terms},
                    {"degrees_of_freedom", point.degrees_of_freedom},
                    {"noise", name(point.noise)}});
  }
  return json;
}

Json to_json(std::span<const MtiePoint> points) {
  Json json = Json::array();
  for (const MtiePoint& point : points) {
    json.push_back({{"tau_s", point.tau_s},
                    {"mtie_s", point.mtie_s},
                    {"windows", point.windows},
                    {"covered_share", point.covered_share}});
  }
  return json;
}

std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace ftcs
