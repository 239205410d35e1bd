// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/demo_report.h"

#include <cmath>

#include <fmt/format.h>

#include "ftcs/report/cycle_report.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs::daemon {

Table demo_table(const DemoResult& result) {
  Table table({"servo", "locked", "cycles to lock", "true error, RMS", "offset it sees, RMS",
               "rate error, RMS", "excursions", "rejected"});
  for (const experiment::TrialResult& servo : result.servos) {
    table.add_row({servo.servo, servo.locked ? "yes" : "no",
                   servo.cycles_to_lock ? Cell::count(*servo.cycles_to_lock) : Cell{"-"},
                   format_time(servo.rms_time_error_ns), format_time(servo.rms_perceived_offset_ns),
                   fmt::format("{:.3f} ppm", servo.rate_error_ppb * 1e-3),
                   Cell::count(servo.excursions), Cell::count(servo.rejected)});
  }
  return table;
}

std::string demo_method(const DemoOptions& options, const DemoResult& result) {
  return fmt::format(
      "Two processes, real PTP messages over loopback, {} timestamps, {} Sync messages, one "
      "every {}.\n"
      "Start: {} of offset, {:g} ppm of skew; rate limit ±{:g} ppm; nobody may step.\n"
      "Locked: true offset inside ±{} (5 x 1.4826 x MAD of t2 - t1) for {} Syncs, counted from the "
      "servo's first "
      "action.\nRMS figures from lock to the end of the run (not locked: its second half).\n",
      result.timestamps, result.samples, format_time(result.sync_interval_ns),
      format_time(options.offset.ns()), options.skew_ppb * 1e-3, options.max_frequency_ppb * 1e-3,
      format_time(result.lock_band_ns), experiment::ServoTrial::kLockDwell);
}

std::string demo_text(const DemoOptions& options, const DemoResult& result) {
  return "\n" + demo_method(options, result) + "\n" + demo_table(result).to_text();
}

namespace {

void add_ptp(Json& root, const DemoOptions& options, const DemoResult& result) {
  root["sync_interval_ns"] = result.sync_interval_ns;
  root["initial_offset_ns"] = options.offset.ns();
  root["skew_ppb"] = options.skew_ppb;
  root["max_frequency_ppb"] = options.max_frequency_ppb;
  root["timestamps"] = result.timestamps;
  root["link_delay_ns"] = result.link_delay_ns;
  root["asymmetry_ns"] = result.asymmetry_ns;
  root["lock_band_ns"] = result.lock_band_ns;
  root["ptp"] = Json::array();
  for (const experiment::TrialResult& servo : result.servos) {
    Json row;
    row["servo"] = servo.servo;
    row["locked"] = servo.locked;
    row["cycles_to_lock"] = servo.cycles_to_lock ? Json(*servo.cycles_to_lock) : Json(nullptr);
    row["locked_at_sync"] = servo.locked_at_sync ? Json(*servo.locked_at_sync) : Json(nullptr);
    row["lock_band_ns"] = result.lock_band_ns;
    row["excursions"] = servo.excursions;
    row["rms_perceived_offset_ns"] = servo.rms_perceived_offset_ns;
    row["rms_time_error_ns"] = servo.rms_time_error_ns;
    row["rms_second_half_ns"] = servo.rms_second_half_ns;
    row["mean_second_half_ns"] = servo.mean_second_half_ns;
    row["rate_error_ppb"] = servo.rate_error_ppb;
    row["final_time_error_ns"] = servo.final_time_error_ns;
    row["samples"] = servo.samples;
    row["rejected"] = servo.rejected;
    root["ptp"].push_back(row);
  }
}

}  // namespace

std::string demo_json(const DemoOptions& options, const DemoResult* result,
                      const EthercatDemo* ethercat) {
  Json root;
  root["duration_s"] = options.duration_s;
  if (result != nullptr) add_ptp(root, options, *result);
  if (ethercat != nullptr) {
    root["ethercat"] = ethercat_demo_json(*ethercat);
    root["two_machines"] = two_machines_json(ethercat->machines);
  }
  return dump(root);
}

}  // namespace ftcs::daemon
