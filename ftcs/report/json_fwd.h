// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace ftcs {

/// Fields in the order in which they were written. A number that is not finite is written as null.
/// For headers that name it: who has one in his hands includes json.h, which is dear to parse.
using Json = nlohmann::ordered_json;

}  // namespace ftcs
