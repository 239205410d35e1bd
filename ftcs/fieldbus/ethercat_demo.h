// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "ftcs/experiment/two_machines.h"
#include "ftcs/fieldbus/local_segment.h"
#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/report/json_fwd.h"

namespace ftcs::daemon {

struct EthercatDemoOptions {
  double seconds_per_servo = 6.0;
  bool live_view = true;
};

/// The second half of the demonstration: eight drives and a MainDevice on loopback, one run for
/// each way to keep the cycle in phase with their clock.
struct EthercatDemo {
  std::unique_ptr<LocalSegment> segment;
  std::vector<std::unique_ptr<MainRunner>> runs;  ///< FTCS first
  platform::RealtimeSetup setup;
  experiment::TwoMachinesResult machines;  ///< in simulated time; no rows: interrupted

  [[nodiscard]] std::vector<const MainRunner*> views() const;
};

/// Says on standard error what went wrong, and returns nothing then.
[[nodiscard]] std::unique_ptr<EthercatDemo> run_ethercat_demo(platform::Kernel& kernel,
                                                              const EthercatDemoOptions& options);
[[nodiscard]] std::string ethercat_demo_text(const EthercatDemo& demo);
[[nodiscard]] Json ethercat_demo_json(const EthercatDemo& demo);

}  // namespace ftcs::daemon
