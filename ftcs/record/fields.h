// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ftcs {

/// Without spaces and tabs at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// ASCII letters in lower case, independent of the locale; other octets as they are.
[[nodiscard]] std::string lower_case(std::string_view text);

/// What separates the fields of a line: a comma if there is one, else a semicolon, else runs of
/// spaces and tabs (' ').
[[nodiscard]] char separator_of(std::string_view line);

/// Fields, trimmed, without the double quotes around them. The views point into `line`.
[[nodiscard]] std::vector<std::string_view> split_fields(std::string_view line, char separator);

/// The whole of `text` as a finite decimal number, with or without sign and exponent; independent
/// of the locale.
[[nodiscard]] std::optional<double> parse_decimal(std::string_view text);

/// Nanoseconds of a record that a Duration holds, with room for sums: at most 4.6e18, 146 years,
/// either way.
[[nodiscard]] bool fits_duration(double ns);

/// An empty field, "-", "nan", "na", "null": a value that is known to be missing. Case does not
/// matter.
[[nodiscard]] bool is_missing(std::string_view text);

}  // namespace ftcs
