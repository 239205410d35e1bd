// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/cycle_csv.h"

#include <array>
#include <cerrno>
#include <system_error>

#include <fmt/format.h>

#include "ftcs/platform/durable_file.h"

namespace ftcs::daemon {

std::optional<WriteError> CycleCsv::open(const std::string& path) {
  path_ = path;
  file_.reset(std::fopen(path.c_str(), "a"));
  check(is_open());
  return error_;
}

void CycleCsv::begin() {
  if (!is_open()) return;
  // The file that was opened, whatever stands at its name by now.
  check(platform::cut_to_nothing(file_.get()));
  constexpr const char* kHeader =
      "cycle,state,verdict,phase_error_ns,lateness_ns,round_trip_ns,rate_ppb,working_counter,"
      "margin_ns,skipped,bus_state,dc_to_plant_ns,dc_to_plant_sigma_ns,bus_rate_ppb,compared_drive,"
      "difference_ns\n";
  if (is_open()) check(std::fputs(kHeader, file_.get()) >= 0 && std::fflush(file_.get()) == 0);
}

void CycleCsv::check(bool good) {
  if (good) return;
  error_ =
      WriteError{fmt::format("cannot write {}: {}", path_, std::generic_category().message(errno))};
  file_.reset();
}

void CycleCsv::write(std::uint64_t cycle, const node::CycleNode& node) {
  if (!is_open()) return;
  const CycleDecision& decision = node.decision();
  const BusClockDecision& bus = node.bus();
  const std::uint16_t drive = node.main().last_cycle().compared;
  const bool somebody = drive != ethercat::CycleReport::kNobody;
  constexpr std::size_t kLongestLine = 400;
  std::array<char, kLongestLine> line{};
  const auto end = fmt::format_to_n(
      line.data(), line.size(),
      "{},{},{},{:.1f},{:.1f},{:.1f},{:.3f},{},{},{},{},{:.1f},{:.1f},{:.1f},{},{}\n", cycle,
      static_cast<int>(decision.state), static_cast<int>(decision.verdict),
      decision.phase_error.ns(), decision.lateness.ns(),
      (node.sample().received - node.sample().sent).ns(), decision.rate.ppb(),
      node.main().last_cycle().working_counter, node.margin_ns(), decision.skipped,
      static_cast<int>(bus.state), bus.dc_to_plant.ns(), bus.sigma_ns, bus.rate_ppb,
      somebody ? static_cast<int>(drive) : -1,
      somebody ? node.clocks()[drive].last.value_or(0) : 0);
  const auto size = static_cast<std::size_t>(end.out - line.data());
  check(std::fwrite(line.data(), 1, size, file_.get()) == size);
}

std::optional<WriteError> CycleCsv::finish() {
  if (is_open()) check(std::fflush(file_.get()) == 0);
  return error_;
}

}  // namespace ftcs::daemon
