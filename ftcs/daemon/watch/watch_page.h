// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace ftcs::daemon {

/// The live page: one document, nothing else is fetched but events and states of daemons
/// (page.html with page.css and page.js in it, made by embed_page.cmake).
[[nodiscard]] const std::string& watch_page();

}  // namespace ftcs::daemon
