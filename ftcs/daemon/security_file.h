// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/platform/keyed_code.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// One key line of ptp4l's sa_file: `id type [length] value`.
struct KeyLine {
  std::uint32_t id = 0;
  platform::CodeKind kind = platform::CodeKind::kHmacSha256Truncated;
  std::vector<std::uint8_t> key{};
};

/// One association: `[security_association]`, `spp N`, settings, keys.
struct AssociationLines {
  std::uint8_t spp = 0;
  std::uint16_t seqid_window = 3;
  bool allow_mutable = false;
  std::vector<KeyLine> keys{};
};

/// What stands in a file in the format of ptp4l's sa_file. ptp4l leaves out what it does not
/// understand; here it is an error: "line 3: ...". No error repeats a key.
[[nodiscard]] Result<std::vector<AssociationLines>, std::string> parse_security_file(
    std::string_view text);

}  // namespace ftcs::daemon
