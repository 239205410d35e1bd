// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "ftcs/daemon/demo_receiver.h"
#include "ftcs/fieldbus/ethercat_demo.h"
#include "ftcs/report/table.h"

namespace ftcs::daemon {

/// Table and what it means, for people.
[[nodiscard]] std::string demo_text(const DemoOptions& options, const DemoResult& result);
[[nodiscard]] Table demo_table(const DemoResult& result);
[[nodiscard]] std::string demo_method(const DemoOptions& options, const DemoResult& result);
/// Field names: docs/demo.md. A part that did not run is left out.
[[nodiscard]] std::string demo_json(const DemoOptions& options, const DemoResult* result,
                                    const EthercatDemo* ethercat);
[[nodiscard]] std::string demo_html(const DemoOptions& options, const DemoResult* result,
                                    const EthercatDemo* ethercat);

}  // namespace ftcs::daemon
