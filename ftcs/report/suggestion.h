// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ftcs {

/// What was probably meant by a word that nobody knows: the name that it begins, or that is no more
/// than two letters away; case, '-' and '_' make no difference. Empty: nothing is near.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& names);

/// "; did you mean 'status'?", the end of an error line; empty if there is nothing to suggest.
[[nodiscard]] std::string did_you_mean(std::string_view suggested);

}  // namespace ftcs
