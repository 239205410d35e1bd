// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ftcs {

/// Seconds in a unit of time: s, ms, us, ns, ps, d (days).
[[nodiscard]] std::optional<double> seconds_of_unit(std::string_view unit);

/// Fractional frequency of a unit: 1, ppm, ppb, ppt.
[[nodiscard]] std::optional<double> fraction_of_unit(std::string_view unit);

/// Hertz in a unit of frequency: Hz, kHz, MHz, GHz.
[[nodiscard]] std::optional<double> hertz_of_unit(std::string_view unit);

/// The unit at the end of a heading: "offset_ns", "offset (ns)", "offset / ns", "freq [ppb]"; empty
/// if there is none.
[[nodiscard]] std::string unit_in_heading(std::string_view heading);

/// The heading in small letters and without its unit: "offset" of "Offset (ns)" and "offset_ns".
[[nodiscard]] std::string name_in_heading(std::string_view heading);

}  // namespace ftcs
