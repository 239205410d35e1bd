// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/experiment/toml_table.h"
#include "ftcs/sim/two_way.h"

namespace ftcs::experiment {

/// [clock]: the oscillator and what its clock can do.
void read_clock(TomlTable& table, sim::NodeSpec& node);
/// [path]: both directions, then [path.forward] and [path.backward] where they differ.
void read_path(TomlTable& table, sim::NodeSpec& node);

}  // namespace ftcs::experiment
