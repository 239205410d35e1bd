// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "ftcs/record/quantity_text.h"

namespace ftcs::app {

/// Refuses everything but numbers from `lowest` to `highest`, not-a-number too, which CLI::Range
/// lets pass.
[[nodiscard]] inline CLI::Validator number_from(double lowest, double highest) {
  return {[lowest, highest](const std::string& text) {
            const auto number = parse_number(text, lowest, highest);
            return number ? std::string{} : number.error().message;
          },
          fmt::format("{:g} to {:g}", lowest, highest)};
}

/// The same for whole numbers.
[[nodiscard]] inline CLI::Validator integer_from(std::int64_t lowest, std::int64_t highest) {
  return {[lowest, highest](const std::string& text) {
            const auto number = parse_integer(text, lowest, highest);
            return number ? std::string{} : number.error().message;
          },
          fmt::format("{} to {}", lowest, highest)};
}

}  // namespace ftcs::app
