// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace ftcs::app {

/// UTC, seconds since 1970: no moment in which this program runs can be earlier. SOURCE_DATE_EPOCH
/// where the build had it, else the date of the release, so that one source makes one program.
[[nodiscard]] std::int64_t build_date_utc_s();

}  // namespace ftcs::app
