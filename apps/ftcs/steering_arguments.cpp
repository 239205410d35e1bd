// SPDX-License-Identifier: MIT
#include "apps/ftcs/steering_arguments.h"

#include <array>
#include <cmath>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "ftcs/record/quantity_text.h"

namespace ftcs::app {
namespace {

using Wrong = std::optional<std::string>;

constexpr double kPpb = 1e-9;
constexpr double kLargestPpb = 900e6;          // a clock must go on
constexpr double kCoarsestPpb = 100e6;         // as scenario files have it
constexpr double kLongestNs = 1e9;             // longer than the interval of most references
constexpr double kSmallestFrequencyPpb = 1.0;  // less would steer nothing

Wrong outside(double value, double lowest, double highest, const char* unit) {
  if (value >= lowest && value <= highest) return std::nullopt;  // not a number: outside
  return fmt::format("{:.10g} {}: expected {:g} to {:g} {}", value, unit, lowest, highest, unit);
}

Wrong set_ns(double ns, Nanoseconds& target) {
  if (auto wrong = outside(ns, 0.0, kLongestNs, "ns")) return wrong;
  target = Nanoseconds{std::llround(ns)};
  return std::nullopt;
}

Wrong named(const char* flag, Wrong wrong) {
  return wrong ? Wrong(std::string(flag) + ": " + *wrong) : std::nullopt;
}

template <class Target>
Wrong set_rate(const char* flag, const std::string& text, Wrong (*set)(double, Target&),
               Target& target) {
  if (text.empty()) return std::nullopt;
  const auto ppb = parse_ppb(text);
  return named(flag, ppb ? set(*ppb, target) : Wrong(ppb.error().message));
}

Wrong set_time(const char* flag, const std::string& text, Wrong (*set)(double, ServoConfig&),
               ServoConfig& target) {
  if (text.empty()) return std::nullopt;
  const auto time = parse_duration(text);
  return named(flag, time ? set(time->ns(), target) : Wrong(time.error().message));
}

/// The first constraint in force that only the adaptive servo plans with.
const char* adaptive_constraint(const ServoConfig& servo, const SteeringRules& rules) {
  const SteeringLimits& steering = servo.adaptive.steering;
  if (rules.largest_rate_change > 0.0) return "max_frequency_change";
  if (steering.rate_granularity > 0.0) return "frequency_granularity";
  if (steering.time_granularity > Nanoseconds{0}) return "timer_granularity";
  if (steering.latency > Nanoseconds{0}) return "steering_latency";
  return nullptr;
}

}  // namespace

void add_steering_flags(CLI::App& command, SteeringArguments& arguments) {
  struct Flag {
    const char* name;
    std::string& target;
    const char* type;
    std::string help;
  };
  const std::array flags{
      Flag{"--servo", arguments.servo, "NAME", servo_names() + "; default adaptive"},
      Flag{"--max-frequency", arguments.max_frequency, "RATE",
           "largest adjustment, for example 100ppm; default 500ppm for the system clock, 0: the "
           "clock's own limit"},
      Flag{"--max-frequency-change", arguments.max_frequency_change, "RATE",
           "adaptive: the clock's rate changes by no more at a time, for example 1ppm; 0: any"},
      Flag{"--frequency-granularity", arguments.frequency_granularity, "RATE",
           "adaptive: the clock can hold multiples of this, for example 0.1ppb; 0: any"},
      Flag{"--timer-granularity", arguments.timer_granularity, "TIME",
           "adaptive: corrections last multiples of this, for example 1ms; 0: any"},
      Flag{"--steering-latency", arguments.steering_latency, "TIME",
           "adaptive: a command takes effect this late, for example 50us; default 0"},
  };
  for (const Flag& flag : flags) {
    command.add_option(flag.name, flag.target, flag.help)->type_name(flag.type);
  }
  command.add_flag("--never-step", arguments.never_step,
                   "time never jumps, whatever thresholds say");
}

Wrong choose_servo(const SteeringArguments& arguments, ServoConfig& servo) {
  if (arguments.servo.empty()) return std::nullopt;
  const auto kind = servo_kind_from_name(arguments.servo);
  if (!kind) {
    return fmt::format("--servo: unknown servo '{}' (known: {})", arguments.servo, servo_names());
  }
  servo.kind = *kind;
  return std::nullopt;
}

Wrong apply_steering(const SteeringArguments& arguments, ServoConfig& servo, SteeringRules& rules) {
  if (arguments.never_step) rules.never_step = true;
  for (auto wrong :
       {set_rate("--max-frequency", arguments.max_frequency, set_max_frequency, servo),
        set_rate("--max-frequency-change", arguments.max_frequency_change, set_max_frequency_change,
                 rules),
        set_rate("--frequency-granularity", arguments.frequency_granularity,
                 set_frequency_granularity, servo),
        set_time("--timer-granularity", arguments.timer_granularity, set_timer_granularity, servo),
        set_time("--steering-latency", arguments.steering_latency, set_steering_latency, servo)}) {
    if (wrong) return wrong;
  }
  return std::nullopt;
}

Wrong check_steering(const ServoConfig& servo, const SteeringRules& rules) {
  if (const auto error = validate(servo)) return std::string(describe(*error));
  if (servo.kind == ServoKind::kFreeRunning) return std::nullopt;  // steers nothing
  if (servo.kind != ServoKind::kAdaptive) {
    const char* const constraint = adaptive_constraint(servo, rules);
    if (constraint == nullptr) return std::nullopt;
    return fmt::format("{}: the servo {} cannot keep to it, only adaptive can", constraint,
                       servo_kind_name(servo.kind));
  }
  const double granularity = servo.adaptive.steering.rate_granularity;
  if (granularity > servo.limits.fastest.deviation()) {
    return "frequency_granularity: coarser than max_frequency, so that no rate could be set";
  }
  if (rules.largest_rate_change > 0.0 && granularity >= rules.largest_rate_change) {
    return "frequency_granularity: not finer than max_frequency_change, so that no rate could be "
           "changed";
  }
  return std::nullopt;
}

Wrong set_max_frequency(double ppb, ServoConfig& servo) {
  if (ppb == 0.0) {
    servo.limits = RateLimits::symmetric_ppb(kLargestPpb);
    return std::nullopt;
  }
  if (auto wrong = outside(ppb, kSmallestFrequencyPpb, kLargestPpb, "ppb")) {
    return *wrong + ", or 0: the clock's own limit";
  }
  servo.limits = RateLimits::symmetric_ppb(ppb);
  return std::nullopt;
}

Wrong set_max_frequency_change(double ppb, SteeringRules& rules) {
  if (auto wrong = outside(ppb, 0.0, kLargestPpb, "ppb")) return wrong;
  rules.largest_rate_change = ppb * kPpb;
  return std::nullopt;
}

Wrong set_frequency_granularity(double ppb, ServoConfig& servo) {
  if (auto wrong = outside(ppb, 0.0, kCoarsestPpb, "ppb")) return wrong;
  servo.adaptive.steering.rate_granularity = ppb * kPpb;
  return std::nullopt;
}

Wrong set_timer_granularity(double ns, ServoConfig& servo) {
  return set_ns(ns, servo.adaptive.steering.time_granularity);
}

Wrong set_steering_latency(double ns, ServoConfig& servo) {
  return set_ns(ns, servo.adaptive.steering.latency);
}

std::string servo_names() {
  std::string names;
  for (const ServoKindName& known : kServoKinds) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", known.name);
  }
  return names;
}

}  // namespace ftcs::app
