// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <nlohmann/json.hpp>

#include "ftcs/analysis/convergence.h"
#include "ftcs/analysis/mtie.h"
#include "ftcs/analysis/stability.h"
#include "ftcs/analysis/statistics.h"
#include "ftcs/report/json_fwd.h"

namespace ftcs {

/// A number, or null where there is no figure.
[[nodiscard]] Json number(double value);

/// Field names are an interface: they are only added to, never renamed. `unit` ends the names of
/// figures, as in rms_ns; values are divided by `scale` (1e-9 for nanoseconds from seconds).
[[nodiscard]] Json to_json(const RunningStatistics& statistics, const std::string& unit,
                           double scale = 1.0);
[[nodiscard]] Json to_json(const Summary& summary, const std::string& unit, double scale = 1.0);
/// settled_sample, cycles_from_first_message, cycles_from_first_action; null = never.
[[nodiscard]] Json to_json(const Convergence& convergence);
/// tau_s, deviation, lower, upper, terms, degrees_of_freedom, noise.
[[nodiscard]] Json to_json(std::span<const StabilityPoint> points);
/// tau_s, mtie_s, windows.
[[nodiscard]] Json to_json(std::span<const MtiePoint> points);

/// Two spaces of indentation, a newline at the end; bytes that are not UTF-8 are replaced.
[[nodiscard]] std::string dump(const Json& json);

}  // namespace ftcs
