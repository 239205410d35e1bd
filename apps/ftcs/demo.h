// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "ftcs/daemon/demo_receiver.h"
#include "ftcs/report/table.h"

namespace ftcs::daemon {
struct EthercatDemo;
}

namespace ftcs::app {

using daemon::DemoOptions;
using daemon::DemoReceiver;
using daemon::DemoResult;

/// Where the figures go; empty: nowhere.
struct DemoFiles {
  std::string json;
  std::string html;
};

/// Runs both parts; prints tables and sentences. Returns an exit code: both locked or not.
[[nodiscard]] int run_demo(const DemoOptions& options, const DemoFiles& files);

/// Table and what it means, for people.
[[nodiscard]] std::string demo_text(const DemoOptions& options, const DemoResult& result);
[[nodiscard]] Table demo_table(const DemoResult& result);
[[nodiscard]] std::string demo_method(const DemoOptions& options, const DemoResult& result);
/// Field names: docs/demo.md. A part that did not run is left out.
[[nodiscard]] std::string demo_json(const DemoOptions& options, const DemoResult* result,
                                    const daemon::EthercatDemo* ethercat);
[[nodiscard]] std::string demo_html(const DemoOptions& options, const DemoResult* result,
                                    const daemon::EthercatDemo* ethercat);

}  // namespace ftcs::app
