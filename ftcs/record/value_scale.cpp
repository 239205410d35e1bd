// SPDX-License-Identifier: MIT
#include "ftcs/record/value_scale.h"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "ftcs/analysis/statistics.h"
#include "ftcs/record/fields.h"
#include "ftcs/record/units.h"

namespace ftcs {
namespace {

/// Fractional frequencies beyond it belong to no clock.
constexpr double kLargestFraction = 0.1;
/// Phases beyond it, and with so little change, are more likely frequencies.
constexpr double kLargestSteadyPhase = 1000.0;
constexpr double kSteady = 1e-3;

std::string text_of(double value) { return fmt::format("{:.12g}", value); }

Result<ValueScale, std::string> scale_of_hertz(const SeriesOptions& options,
                                               const std::string& unit, double hertz) {
  if (!options.nominal_hz) {
    return "values in " + unit +
           ": expected --nominal, the frequency in Hz that they should have (--nominal 10e6)";
  }
  const double nominal = *options.nominal_hz;
  return ValueScale{nominal / hertz, hertz / nominal,
                    "values: frequency in " + unit + ", nominal " + text_of(nominal) + " Hz"};
}

}  // namespace

RecordKind kind_of(const SeriesOptions& options, std::string_view heading) {
  if (options.kind) return *options.kind;
  const std::string unit = options.unit.empty() ? unit_in_heading(heading) : options.unit;
  const std::string word = lower_case(heading);
  if (fraction_of_unit(unit) || hertz_of_unit(unit) || word.find("freq") != std::string::npos)
    return RecordKind::kFrequency;
  return word.find("offset") != std::string::npos ? RecordKind::kOffset : RecordKind::kPhase;
}

Result<ValueScale, std::string> choose_scale(const SeriesOptions& options, RecordKind kind,
                                             std::string_view heading) {
  const bool frequency = kind == RecordKind::kFrequency;
  std::string unit = options.unit;
  const char* reason = "as asked";
  if (unit.empty()) {
    unit = unit_in_heading(heading);
    reason = "from the heading";
  }
  if (unit.empty()) {
    unit = frequency ? "1" : kind == RecordKind::kOffset ? "ns" : "s";
    reason = "by convention; --unit sets it";
  }
  if (const auto hertz = hertz_of_unit(unit); frequency && hertz)
    return scale_of_hertz(options, unit, *hertz);
  if (options.nominal_hz) {
    return "--nominal belongs to values in Hz, kHz, MHz or GHz; these are " +
           std::string(name(kind)) + " in " + unit + " (--unit Hz says otherwise)";
  }
  const auto scale = frequency ? fraction_of_unit(unit) : seconds_of_unit(unit);
  if (!scale) {
    return "the unit of " + std::string(name(kind)) + " values is one of " +
           (frequency ? "1, ppm, ppb, ppt, Hz, kHz, MHz, GHz" : "s, ms, us, ns, ps, d") + ", got " +
           quoted_excerpt(unit);
  }
  return ValueScale{0.0, *scale,
                    "values: " + std::string(name(kind)) + " in " + unit + " (" + reason + ")"};
}

std::string suspicion_of_hertz(std::span<const double> values, RecordKind kind,
                               const SeriesOptions& options) {
  if (!options.unit.empty() || options.nominal_hz) return {};
  const double median = upper_median({values.begin(), values.end()});
  if (!std::isfinite(median)) return {};
  if (kind == RecordKind::kFrequency && std::abs(median) > kLargestFraction) {
    return "expected fractional frequencies, got values near " + text_of(median) +
           ": a record in Hz needs --unit Hz --nominal F (--unit 1 takes it as it is)";
  }
  if (kind != RecordKind::kPhase || options.kind || std::abs(median) <= kLargestSteadyPhase) {
    return {};
  }
  const bool steady = std::all_of(values.begin(), values.end(), [median](double value) {
    return !std::isfinite(value) || std::abs(value - median) <= kSteady * std::abs(median);
  });
  if (!steady) return {};
  return "expected phase in seconds, got values that stay near " + text_of(median) +
         ": a record in Hz needs --unit Hz --nominal F (--kind phase takes it as it is)";
}

}  // namespace ftcs
