// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace ftcs {

// Files that the build reads into the program (embed_assets.cmake).

void append_dygraph_js(std::string& text);
void append_dygraph_css(std::string& text);
void append_report_js(std::string& text);
void append_report_css(std::string& text);

}  // namespace ftcs
