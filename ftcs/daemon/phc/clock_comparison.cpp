// SPDX-License-Identifier: MIT
#include "ftcs/daemon/phc/clock_comparison.h"

#include <utility>

namespace ftcs::daemon {

using platform::ClockDevice;
using platform::CrossMethod;
using platform::CrossTimestamper;

Result<ClockComparison, std::string> ClockComparison::make(platform::Kernel& kernel,
                                                           const ClockDevice& source,
                                                           const ClockDevice& sink) {
  if (source.is_same_clock(sink)) {
    const std::string& name = source.name();
    if (name == sink.name()) return name + ": source and sink are the same clock";
    return name + " and " + sink.name() + ": source and sink are the same clock by two names";
  }
  ClockComparison comparison;
  const auto add = [&](const ClockDevice& device, std::optional<CrossTimestamper>& timestamper) {
    if (device.is_system()) return true;
    timestamper.emplace(kernel, device);
    return timestamper->method() != CrossMethod::kNone;
  };
  for (const bool ok : {add(source, comparison.source_), add(sink, comparison.sink_)}) {
    if (!ok) return std::string("the driver cannot compare the clock with CLOCK_REALTIME");
  }
  return comparison;
}

Result<Comparison, platform::OsError> ClockComparison::read(int readings) {
  platform::CrossReading source;
  platform::CrossReading sink;
  if (source_) {
    const auto reading = source_->read(readings);
    if (!reading) return reading.error();
    source = *reading;
  }
  if (sink_) {
    const auto reading = sink_->read(readings);
    if (!reading) return reading.error();
    sink = *reading;
  }
  if (!sink_) return Comparison{source.phc_ns, source.system_ns, source.delay_ns};
  if (!source_) return Comparison{sink.system_ns, sink.phc_ns, sink.delay_ns};
  // The source goes on for as long as CLOCK_REALTIME says; over microseconds its rate is as good
  // as any.
  return Comparison{source.phc_ns + (sink.system_ns - source.system_ns), sink.phc_ns,
                    source.delay_ns + sink.delay_ns};
}

std::string ClockComparison::method() const {
  std::string text;
  for (const auto* timestamper : {&source_, &sink_}) {
    if (!*timestamper) continue;
    text += (text.empty() ? "" : ", ") + std::string(platform::name((*timestamper)->method()));
  }
  return text;
}

}  // namespace ftcs::daemon
