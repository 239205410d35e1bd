// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/time/result.h"

namespace ftcs::platform {

enum class Readers : std::uint8_t { kOwner, kEverybody };

/// Replaces the file `path` by `content` so that at any moment, a crash or loss of power included,
/// either the old or the new content is there: written to a file without a name (or, where that
/// cannot be had or named, of a temporary name beside it), synchronised, named, renamed, the folder
/// synchronised. What exists at `path` must be a regular file: a device, a pipe or a link is not
/// replaced. Whatever the umask is, the new file has the mode of `readers`. Returns what failed,
/// with the system's reason.
[[nodiscard]] std::optional<std::string> write_durably(const std::string& path,
                                                       std::string_view content,
                                                       Readers readers = Readers::kOwner);

/// A regular file that is open, whatever stands at its name by now; anything else stays as it is.
/// False with errno: it could not be cut.
[[nodiscard]] bool cut_to_nothing(std::FILE* file);

/// What stands in the regular file `path` (a link to one will do); else errno: EINVAL where it is
/// something else, EFBIG beyond `largest` octets. A pipe in its place is not waited for.
[[nodiscard]] Result<std::vector<char>, int> read_regular(const std::string& path,
                                                          std::size_t largest);

}  // namespace ftcs::platform
