// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "ftcs/daemon/management_server.h"
#include "ftcs/daemon/status_report.h"
#include "ftcs/fieldbus/run_status.h"
#include "ftcs/platform/stop_flag.h"

namespace ftcs::app {
namespace {

struct StatusArguments {
  std::string socket;
  bool json = false;
};

std::span<const std::uint8_t> octets(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

struct Answer {
  std::string json;
  daemon::StatusForPeople for_people;
};

/// The answer, or what is wrong.
Result<Answer, std::string> ask(const std::string& path) {
  constexpr int kPatienceMs = 2000;
  auto client = platform::LocalSocket::client(path);
  if (!client) return client.error().message();
  if (const auto error = client->send(path, octets(daemon::kStatusQuery))) return error->message();
  client->wait(kPatienceMs);
  const auto answer = client->receive();
  if (!answer) {
    return fmt::format("socket {}: no answer within {} s; is that ftcs?", path, kPatienceMs / 1000);
  }
  std::string json(answer->bytes.begin(), answer->bytes.end());
  auto status = daemon::read_status(json);
  if (!status) return fmt::format("socket {}: the answer is no status of ftcs", path);
  return Answer{std::move(json), std::move(*status)};
}

/// The first of the usual places where somebody answers.
Result<Answer, std::string> ask_somebody(const std::string& given, const platform::StopFlag& stop) {
  if (!given.empty()) return ask(given);
  std::string tried;
  std::vector<std::string> paths = platform::usual_socket_paths(daemon::kSocketName);
  for (std::string& path : platform::usual_socket_paths(daemon::kEthercatSocketName)) {
    paths.push_back(std::move(path));
  }
  for (const std::string& path : paths) {
    auto answer = ask(path);
    if (answer) return answer;
    if (stop.is_set()) break;
    tried += fmt::format("{}{}", tried.empty() ? "" : "; ", answer.error());
  }
  return fmt::format("no running instance found ({}); -s names its socket", tried);
}

int run(const StatusArguments& arguments) {
  const platform::StopFlag stop;  // our socket's folder goes, whatever ends the wait
  const auto answer = ask_somebody(arguments.socket, stop);
  if (!answer) {
    if (!stop.is_set()) fmt::print(stderr, "ftcs status: {}\n", answer.error());
    return kRuntimeError;
  }
  fmt::print("{}", arguments.json ? answer->json : answer->for_people.text);
  return answer->for_people.exit_code;
}

}  // namespace

void add_status_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "status", "what a running ftcs ptp or ftcs ethercat does (over its socket)");
  const auto arguments = std::make_shared<StatusArguments>();
  command
      ->add_option("-s,--uds_address", arguments->socket,
                   "the instance's socket; default: /var/run/ftcs or $XDG_RUNTIME_DIR/ftcs, "
                   "then the same with -ethercat")
      ->type_name("PATH");
  command->add_flag("--json", arguments->json, "the whole status as one JSON object");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace ftcs::app
