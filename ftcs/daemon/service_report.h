// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "ftcs/platform/service_manager.h"
#include "ftcs/time/instant.h"

namespace ftcs::daemon {

/// What a running daemon tells the service manager: alive in each turn of the loop, ready at its
/// first lock, and a sentence about the clock, at most once a second.
class ServiceReport {
 public:
  explicit ServiceReport(
      platform::ServiceManager manager = platform::ServiceManager::from_environment())
      : manager_(std::move(manager)) {}

  /// Once per turn of the loop. `sentence()` is asked only when it is due; it begins with the
  /// state: "locked to ...", "not locked: ...".
  template <class Sentence>
  void turn(FreeRunningTime now, bool locked, const Sentence& sentence) {
    manager_.alive(now.since_epoch().floor_ns());
    const bool changed = locked != locked_;
    locked_ = locked;
    if (changed || !told_ || now - *told_ >= kBetweenSentences) {
      told_ = now;
      manager_.status(sentence());
    }
    if (locked) manager_.ready();
  }
  void stopping() { manager_.stopping(); }

 private:
  static constexpr Duration kBetweenSentences{Nanoseconds{1'000'000'000}};
  platform::ServiceManager manager_;
  bool locked_ = false;
  std::optional<FreeRunningTime> told_{};
};

}  // namespace ftcs::daemon
