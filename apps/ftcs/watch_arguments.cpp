// SPDX-License-Identifier: MIT
#include "apps/ftcs/watch_arguments.h"

#include <filesystem>

namespace ftcs::app {
namespace {

void add_address(CLI::App& command, const char* flag, std::optional<platform::HttpAddress>& target,
                 const char* help) {
  command
      .add_option_function<std::string>(
          flag,
          [flag, &target](const std::string& text) {
            target = platform::parse_http_address(text);
            if (target) return;
            throw CLI::ValidationError(flag, "'" + text +
                                                 "': expected [HOST:]PORT, for example 9320; "
                                                 "without a host the loopback address");
          },
          help)
      ->type_name("[HOST:]PORT");
}

std::string folder_is_there(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;
  if (folder.empty() || std::filesystem::is_directory(folder, ignored)) return {};
  return "'" + path + "': expected a file in a folder that exists";
}

}  // namespace

void add_watch_flags(CLI::App& command, daemon::WatchOptions& options) {
  add_address(command, "--web", options.web,
              "a live page for browsers, read-only; further daemons take the next ports and are on "
              "the same page");
  add_address(command, "--metrics", options.metrics,
              "metrics for Prometheus at /metrics (also those of --web's address)");
  command
      .add_option("--metrics-file", options.metrics_file,
                  "the same into this file every 10 s, for node_exporter's textfile collector")
      ->type_name("FILE")
      ->check(folder_is_there);
  auto* const names = command.add_option_function<std::string>(
      "--metrics-names",
      [&options](const std::string& name) {
        options.names =
            name == "openshift" ? daemon::MetricsNames::kOpenShift : daemon::MetricsNames::kFtcs;
      },
      "ftcs (default) or openshift: names of OpenShift's PTP operator");
  names->check(CLI::IsMember({"ftcs", "openshift"}));
  // Without anybody who reads them names have no effect.
  command.parse_complete_callback([names, &options] {
    if (names->count() == 0 || options.is_wanted()) return;
    throw CLI::ValidationError("--metrics-names",
                               "expected --metrics, --metrics-file or --web with it");
  });
}

}  // namespace ftcs::app
