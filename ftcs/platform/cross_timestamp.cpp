// SPDX-License-Identifier: MIT
#include "ftcs/platform/cross_timestamp.h"

#include <algorithm>
#include <cerrno>
#include <limits>
#include <linux/ptp_clock.h>

namespace ftcs::platform {
namespace {

std::int64_t nanoseconds(const ptp_clock_time& time) noexcept {
  return time.sec * 1'000'000'000 + time.nsec;
}

// Fewer readings than were asked for, or readings that run backward, are no reading.
constexpr int kShortRead = -EPROTO;

// A driver may be held up by firmware or by another processor: asked again at once it mostly
// answers, and the sooner for fewer readings, each of which may be refused.
constexpr int kAttempts = 5;
bool may_pass(int result) noexcept {
  return result == -EBUSY || result == -EAGAIN || result == -EINTR || result == -EIO ||
         result == -ETIMEDOUT;
}

class Quickest {
 public:
  void offer(std::int64_t before, std::int64_t phc, std::int64_t after) noexcept {
    const std::int64_t delay = after - before;
    if (delay < 0 || before == 0 || delay >= best_.delay_ns) return;
    best_ = {phc, before + delay / 2, delay};
  }
  [[nodiscard]] bool found() const noexcept {
    return best_.delay_ns < std::numeric_limits<std::int64_t>::max();
  }
  [[nodiscard]] const CrossReading& reading() const noexcept { return best_; }

 private:
  CrossReading best_{0, 0, std::numeric_limits<std::int64_t>::max()};
};

}  // namespace

const char* name(CrossMethod method) noexcept {
  switch (method) {
    case CrossMethod::kPrecise:
      return "precise";
    case CrossMethod::kExtended:
      return "extended";
    case CrossMethod::kBasic:
      return "basic";
    case CrossMethod::kNone:
      break;
  }
  return "none";
}

CrossTimestamper::CrossTimestamper(Kernel& kernel, const ClockDevice& device) noexcept
    : kernel_(kernel), descriptor_(device.descriptor()), name_(device.name()) {
  for (const auto method : {CrossMethod::kPrecise, CrossMethod::kExtended, CrossMethod::kBasic}) {
    if (persistently(method, 1).result < 0) continue;
    method_ = method;
    return;
  }
}

CrossTimestamper::Attempt CrossTimestamper::attempt(CrossMethod method,
                                                    unsigned readings) noexcept {
  switch (method) {
    case CrossMethod::kPrecise:
      return precise();
    case CrossMethod::kExtended:
      return extended(readings);
    case CrossMethod::kBasic:
      return basic(readings);
    case CrossMethod::kNone:
      break;
  }
  return {-EOPNOTSUPP, {}};
}

CrossTimestamper::Attempt CrossTimestamper::persistently(CrossMethod method,
                                                         unsigned readings) noexcept {
  Attempt made = attempt(method, readings);
  for (int i = 1; i < kAttempts && may_pass(made.result); ++i) {
    readings = std::max(readings / 2, 1U);
    made = attempt(method, readings);
  }
  return made;
}

Result<CrossReading, OsError> CrossTimestamper::read(int readings) {
  const auto count = static_cast<unsigned>(std::clamp(readings, 1, PTP_MAX_SAMPLES));
  const Attempt made = persistently(method_, count);
  if (made.result >= 0) return made.reading;
  OsError error = os_error(-made.result, name_ + ": reading against CLOCK_REALTIME");
  if (made.result == -ENODEV) error.kind = OsErrorKind::kNoSuchDevice;
  if (made.result == kShortRead) error.what += " (incomplete)";
  return error;
}

CrossTimestamper::Attempt CrossTimestamper::precise() noexcept {
  ptp_sys_offset_precise request{};
  const int result = kernel_.control(descriptor_, PTP_SYS_OFFSET_PRECISE, &request);
  if (result < 0) return {result, {}};
  if (nanoseconds(request.sys_realtime) == 0) return {kShortRead, {}};
  return {0, {nanoseconds(request.device), nanoseconds(request.sys_realtime), 0}};
}

CrossTimestamper::Attempt CrossTimestamper::extended(unsigned readings) noexcept {
  ptp_sys_offset_extended request{};
  request.n_samples = readings;
  const int result = kernel_.control(descriptor_, PTP_SYS_OFFSET_EXTENDED, &request);
  if (result < 0) return {result, {}};
  Quickest quickest;
  for (unsigned i = 0; i < std::min(request.n_samples, readings); ++i) {
    quickest.offer(nanoseconds(request.ts[i][0]), nanoseconds(request.ts[i][1]),
                   nanoseconds(request.ts[i][2]));
  }
  if (!quickest.found()) return {kShortRead, {}};
  return {0, quickest.reading()};
}

CrossTimestamper::Attempt CrossTimestamper::basic(unsigned readings) noexcept {
  ptp_sys_offset request{};
  request.n_samples = readings;
  const int result = kernel_.control(descriptor_, PTP_SYS_OFFSET, &request);
  if (result < 0) return {result, {}};
  Quickest quickest;
  for (unsigned i = 0; i < std::min(request.n_samples, readings); ++i) {
    const ptp_clock_time* const read = &request.ts[std::size_t{2} * i];
    quickest.offer(nanoseconds(read[0]), nanoseconds(read[1]), nanoseconds(read[2]));
  }
  if (!quickest.found()) return {kShortRead, {}};
  return {0, quickest.reading()};
}

}  // namespace ftcs::platform
