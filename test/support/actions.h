// SPDX-License-Identifier: MIT
#pragma once

#include <variant>
#include <vector>

#include "ftcs/ptp/actions.h"

namespace ftcs::ptp {

/// What of one kind a port asked for, in its order: of<SendMessage>(actions).
template <class T>
std::vector<T> of(const ActionList& actions) {
  std::vector<T> found;
  for (const Action& action : actions) {
    if (const T* one = std::get_if<T>(&action)) found.push_back(*one);
  }
  return found;
}

}  // namespace ftcs::ptp
