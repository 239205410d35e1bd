// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/maindevice/failure.h"
#include "ftcs/ethercat/wire/frame.h"
#include "ftcs/time/instant.h"

namespace ftcs::ethercat {

/// A part of the bring-up is a pair of functions: `request` writes the next frame (again,
/// unchanged, if the last one was lost), `reply` takes what came back and moves on. Neither waits.
enum class Progress : std::uint8_t { kContinue, kDone, kFailed };

/// Every error ends the bring-up: note it and stop.
[[nodiscard]] inline Progress fail(Failure& place, const Failure& failure) noexcept {
  place = failure;
  return Progress::kFailed;
}

}  // namespace ftcs::ethercat
