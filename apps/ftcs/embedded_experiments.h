// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ftcs::app {

/// A file below experiments/, compiled in (embed_experiments.cmake).
struct EmbeddedExperiment {
  std::string_view path;  ///< below experiments/
  std::string (*text)();
};

[[nodiscard]] std::span<const EmbeddedExperiment> embedded_experiments();

}  // namespace ftcs::app
