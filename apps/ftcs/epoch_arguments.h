// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "ftcs/node/epoch_gate.h"

namespace ftcs::app {

/// What `ftcs ptp` and `ftcs phc` both take about the dates that a real clock may be given.
struct EpochArguments {
  bool allow_epoch = false;
  std::optional<double> max_first_change_s;
  std::optional<double> max_change_s;
  std::optional<double> max_total_change_s;
};

/// `arguments` must outlive `command`.
void add_epoch_flags(CLI::App& command, EpochArguments& arguments);
/// The rules of a program that was built when this one was.
[[nodiscard]] node::EpochRules epoch_rules(const EpochArguments& arguments);

}  // namespace ftcs::app
