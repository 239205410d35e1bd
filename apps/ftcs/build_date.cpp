// SPDX-License-Identifier: MIT
#include "apps/ftcs/build_date.h"

namespace ftcs::app {

std::int64_t build_date_utc_s() { return FTCS_SOURCE_DATE; }

}  // namespace ftcs::app
