// SPDX-License-Identifier: MIT
#include "ftcs/platform/kernel_time_status.h"

#include <algorithm>

namespace ftcs::platform {

// A status of our own, not the old one amended: bits of a kernel PLL that another program used
// would go on steering.
int publish(Kernel& kernel, const TimeStatus& status) noexcept {
  timex request{};
  request.modes = ADJ_STATUS | ADJ_ESTERROR | ADJ_MAXERROR;
  if (!status.synchronised) request.status |= STA_UNSYNC;
  if (status.leap > 0) request.status |= STA_INS;
  if (status.leap < 0) request.status |= STA_DEL;
  request.esterror = static_cast<long>(std::max<std::int64_t>(status.estimated_error_us, 0));
  request.maxerror = static_cast<long>(std::max<std::int64_t>(status.largest_error_us, 0));
  if (status.tai_offset) {
    request.modes |= ADJ_TAI;
    request.constant = *status.tai_offset;
  }
  return std::min(kernel.adjust_clock(CLOCK_REALTIME, request), 0);
}

}  // namespace ftcs::platform
