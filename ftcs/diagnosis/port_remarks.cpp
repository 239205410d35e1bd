// SPDX-License-Identifier: MIT
//
// What a transmitter says of its time, and who else talks.
#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "ftcs/diagnosis/port_rules.h"

namespace ftcs::diagnosis {
namespace {

constexpr std::int64_t kTaiAheadOfUtcS = 37;  // since 2017
constexpr std::int64_t kDayS = 86'400;        // as --max-first-change

const Talkers& talkers_of(const PortSeen& seen) {
  return seen.on_wire ? *seen.on_wire : seen.at_port;
}

std::string date(std::int64_t utc_s) {
  using namespace std::chrono;
  const year_month_day day{floor<days>(sys_seconds{seconds{utc_s}})};
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(day.year()),
                     static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
}

bool has(const Talker& talker, std::uint16_t flag) { return (talker.announce_flags & flag) != 0; }

std::optional<Finding> arbitrary(const Talker& talker) {
  if (has(talker, ptp::flag::kPtpTimescale)) return std::nullopt;
  return Finding{Cause::kTimescale,
                 "the reference keeps an arbitrary timescale, not PTP's (ptpTimescale is not set)",
                 "TAI, the PTP timescale",
                 "give the grandmaster TAI; --allow-epoch follows it as it is"};
}

std::optional<Finding> utc_offset(const Talker& talker) {
  if (!has(talker, ptp::flag::kPtpTimescale) || talker.utc_offset == kTaiAheadOfUtcS) {
    return std::nullopt;
  }
  return Finding{
      Cause::kTimescale, fmt::format("the reference announces TAI - UTC = {} s", talker.utc_offset),
      fmt::format("{} s", kTaiAheadOfUtcS),
      fmt::format("utc_offset {} at the grandmaster (ptp4l) or its leap second list; ours "
                  "comes from --leapfile",
                  kTaiAheadOfUtcS)};
}

std::optional<Finding> date_of(const PortSeen& seen, const Talker& talker) {
  if (!seen.utc_s || !talker.shown_s || !has(talker, ptp::flag::kPtpTimescale)) return std::nullopt;
  const std::int64_t shown = *talker.shown_s - kTaiAheadOfUtcS;
  const std::int64_t off = shown - *seen.utc_s;
  constexpr std::int64_t kSeconds = 2;
  if (std::abs(off + kTaiAheadOfUtcS) < kSeconds) {
    return Finding{
        Cause::kTimescale, "the reference shows UTC and calls it TAI: it is 37 s behind", "TAI",
        "set the grandmaster's clock 37 s ahead, or have it announce an arbitrary timescale"};
  }
  if (std::abs(off) < kDayS) return std::nullopt;
  return Finding{
      Cause::kTimescale,
      fmt::format("the reference shows {} UTC, {:+} s from the system clock", date(shown), off),
      "a date near that of the system clock",
      "set the grandmaster's clock, or the system clock; --max-first-change allows more, "
      "--allow-epoch any date"};
}

}  // namespace

std::vector<Finding> refusals_of_time(const PortSeen& seen) {
  std::vector<Finding> found;
  for (const Talker& talker : talkers_of(seen).all()) {
    if (!is_for(talker, seen.settings) || !talker.announces()) continue;
    for (auto finding : {arbitrary(talker), utc_offset(talker), date_of(seen, talker)}) {
      if (finding) found.push_back(std::move(*finding));
    }
    break;  // of one: they are to be alike
  }
  return found;
}

std::vector<Finding> remarks(const PortSeen& seen) {
  std::string names;
  std::size_t announcers = 0;
  for (const Talker& talker : talkers_of(seen).all()) {
    if (!is_for(talker, seen.settings) || !talker.announces()) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", to_text(talker.port).view());
    ++announcers;
  }
  if (announcers < 2) return {};
  return {{Cause::kTwoTransmitters,
           fmt::format("{} ports announce in this domain: {}", announcers, names),
           "the best of them alone, once the others have heard it",
           "transmitters that do not hear each other may disagree"}};
}

}  // namespace ftcs::diagnosis
