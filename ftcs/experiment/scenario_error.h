// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace ftcs::experiment {

/// Something in a file that its reader must correct: "file:line:column: what is wrong (hint)".
class ScenarioError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace ftcs::experiment
