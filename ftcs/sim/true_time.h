// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/instant.h"

namespace ftcs::sim {

/// The time of the simulated world itself, which no clock in it can read. Resolution 2^-32 ns.
struct TrueTimescale;
using TrueTime = Instant<TrueTimescale>;

}  // namespace ftcs::sim
