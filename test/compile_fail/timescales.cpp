// SPDX-License-Identifier: MIT
// One mistake for each macro; without any macro everything here is right.
#include "ftcs/time/instant.h"

namespace {

[[maybe_unused]] ftcs::Duration use(ftcs::LocalTime local, ftcs::ReferenceTime reference,
                                    ftcs::FreeRunningTime free_running) {
#ifdef LOCAL_MINUS_REFERENCE
  return local - reference;
#endif
#ifdef FREE_RUNNING_LESS_THAN_LOCAL
  if (free_running < local) return {};
#endif
#ifdef REFERENCE_FOR_LOCAL
  local = reference;
#endif
  if (free_running < free_running + ftcs::Duration{}) return local - local;
  return ftcs::offset_from_reference(local, reference);
}

}  // namespace
