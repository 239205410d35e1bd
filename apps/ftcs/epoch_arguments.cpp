// SPDX-License-Identifier: MIT
#include "apps/ftcs/epoch_arguments.h"

#include "apps/ftcs/build_date.h"
#include "apps/ftcs/number_check.h"
#include "ftcs/time/duration.h"

namespace ftcs::app {
namespace {

void take(const std::optional<double>& seconds, Nanoseconds& limit) {
  if (seconds) limit = Nanoseconds{Duration::from_ns(*seconds * 1e9).rounded_ns()};
}

}  // namespace

void add_epoch_flags(CLI::App& command, EpochArguments& arguments) {
  command.add_flag("--allow-epoch", arguments.allow_epoch,
                   "real clocks follow any date, and a timescale without an epoch");
  const auto limit = [&command](const char* name, std::optional<double>& target, const char* help) {
    command.add_option(name, target, help)->type_name("SECONDS")->check(number_from(0.0, 1e9));
  };
  limit("--max-first-change", arguments.max_first_change_s,
        "real clocks: at the start the reference is this near to the system clock; default 86400, "
        "0: any");
  limit("--max-change", arguments.max_change_s,
        "real clocks: the reference jumps by no more at a time; default 1, 0: any");
  limit("--max-total-change", arguments.max_total_change_s,
        "real clocks: and by no more altogether; default 10, 0: any");
}

node::EpochRules epoch_rules(const EpochArguments& arguments) {
  node::EpochRules rules;
  rules.any_epoch = arguments.allow_epoch;
  rules.earliest_utc_s = build_date_utc_s();
  take(arguments.max_first_change_s, rules.largest_first_change);
  take(arguments.max_change_s, rules.largest_change);
  take(arguments.max_total_change_s, rules.largest_total_change);
  return rules;
}

}  // namespace ftcs::app
