// SPDX-License-Identifier: MIT
#include "apps/ftcs/manual.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

namespace ftcs::app {
namespace {

/// Text as roff prints it: no escapes, no requests, a minus that can be copied.
std::string roff(const std::string& text) {
  std::string result;
  bool line_starts = true;
  for (const char c : text) {
    if (line_starts && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else {
      result += c;
    }
    line_starts = c == '\n';
  }
  return result;
}

std::vector<const CLI::App*> visible(const CLI::App& app) {
  std::vector<const CLI::App*> commands = app.get_subcommands([](const CLI::App* command) {
    return !command->get_group().empty() && !command->get_name().empty();
  });
  return commands;
}

std::vector<const CLI::Option*> visible_options(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

/// "-i", "--interface": what may stand on the command line.
std::vector<std::string> names(const CLI::Option& option) {
  std::vector<std::string> result;
  for (const std::string& name : option.get_snames()) result.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) result.push_back("--" + name);
  return result;
}

std::string heading(const CLI::Option& option) {
  if (option.get_positional()) return fmt::format("\\fI{}\\fR", roff(option.get_name(true)));
  std::string line;
  for (const std::string& name : names(option)) {
    line += fmt::format("{}\\fB{}\\fR", line.empty() ? "" : ", ", roff(name));
  }
  const std::string type = option.get_expected_min() == 0 ? "" : option.get_type_name();
  return type.empty() ? line : fmt::format("{} \\fI{}\\fR", line, roff(type));
}

/// Options of one command, by the groups of --help.
std::string options_section(const CLI::App& app) {
  std::string text;
  for (const std::string& group : app.get_groups()) {
    std::string entries;
    for (const CLI::Option* option : visible_options(app)) {
      if (option->get_group() != group) continue;
      entries += fmt::format(".TP\n{}\n{}\n", heading(*option), roff(option->get_description()));
    }
    if (entries.empty()) continue;
    text += group == "Options" || group == "Positionals"
                ? entries
                : fmt::format(".SS \"{}\"\n{}", roff(group), entries);
  }
  return text;
}

std::string synopsis(const CLI::App& app, const std::string& path) {
  std::string line = fmt::format(".B {}\n[\\fIOPTION\\fR]...", roff(path));
  for (const CLI::Option* option : visible_options(app)) {
    if (option->get_positional())
      line += fmt::format(" [\\fI{}\\fR]", roff(option->get_name(true)));
  }
  return line + (visible(app).empty() ? "\n" : " \\fICOMMAND\\fR ...\n");
}

/// `visit` sees each command with its path: "", "ptp", "ethercat run".
template <class Visit>
void walk(const CLI::App& app, const std::string& path, const Visit& visit) {
  std::vector<std::pair<const CLI::App*, std::string>> all{{&app, path}};
  for (std::size_t n = 0; n < all.size(); ++n) {
    const auto [command, name] = all[n];
    visit(*command, name);
    for (const CLI::App* below : visible(*command)) {
      all.emplace_back(below, name + (name.empty() ? "" : " ") + below->get_name());
    }
  }
}

/// Commands below this one, each with its own options.
std::string nested(const CLI::App& app, const std::string& path) {
  std::string text;
  walk(app, path, [&](const CLI::App& command, const std::string& name) {
    if (&command == &app) return;
    text += fmt::format(".SH \"{}\"\n{}.PP\n{}\n{}", roff(name), synopsis(command, name),
                        roff(command.get_description()), options_section(command));
  });
  return text;
}

std::string list_of_commands(const CLI::App& app) {
  std::string text;
  for (const CLI::App* command : visible(app)) {
    text += fmt::format(".TP\n\\fBftcs\\-{}\\fR(1)\n{}\n", roff(command->get_name()),
                        roff(command->get_description()));
  }
  return text;
}

constexpr const char* kExitStatus =
    ".SH \"EXIT STATUS\"\n0: done; a time receiver was locked when it stopped. 1: the system "
    "refused something, or the reference is not usable. 2: a wrong flag, value or configuration "
    "file. 3: stopped in good order, but not locked.\n";

/// The values of an option that takes one of a list: "TEXT:{a,b}".
std::string choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t from = type.find(":{");
  const std::size_t to = type.rfind('}');
  if (from == std::string::npos || to == std::string::npos || to < from) return {};
  std::string list = type.substr(from + 2, to - from - 2);
  std::replace(list.begin(), list.end(), ',', ' ');
  return list;
}

std::string words(const CLI::App& app) {
  std::string list;
  for (const CLI::App* command : visible(app)) list += command->get_name() + " ";
  for (const CLI::Option* option : visible_options(app)) {
    for (const std::string& name : names(*option)) list += name + " ";
  }
  if (!list.empty()) list.pop_back();
  return list;
}

/// Two shell functions that both shells read: words after a path of commands, values of an option.
std::string shell_tables(const CLI::App& program) {
  std::string after = "_ftcs_words() {\n  case $1 in\n";
  std::string values = "_ftcs_values() {\n  case $1 in\n";
  walk(program, "", [&](const CLI::App& app, const std::string& path) {
    after += fmt::format("    '{}') echo '{}' ;;\n", path, words(app));
    for (const CLI::Option* option : visible_options(app)) {
      const std::string list = choices(*option);
      if (list.empty()) continue;
      for (const std::string& name : names(*option)) {
        values += fmt::format("    '{} {}') echo '{}' ;;\n", path, name, list);
      }
    }
  });
  return after + "  esac\n}\n" + values + "  esac\n}\n";
}

}  // namespace

std::string manual_page(const CLI::App& program, const std::string& command) {
  const CLI::App* app = &program;
  for (const CLI::App* known : visible(program)) {
    if (known->get_name() == command) app = known;
  }
  if (!command.empty() && app == &program) return {};
  const std::string name = command.empty() ? "ftcs" : "ftcs-" + command;
  const std::string path = command.empty() ? "ftcs" : "ftcs " + command;
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string page = fmt::format(
      ".TH \"{}\" 1 \"\" \"ftcs {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}"
      ".SH OPTIONS\n{}",
      roff(title), FTCS_VERSION, roff(name), roff(app->get_description()), synopsis(*app, path),
      options_section(*app));
  page += command.empty() ? ".SH COMMANDS\n" + list_of_commands(program) : nested(*app, path);
  if (!app->get_footer().empty()) page += ".SH NOTES\n" + roff(app->get_footer()) + "\n";
  return page + kExitStatus + ".SH \"SEE ALSO\"\n" + (command.empty() ? "" : "\\fBftcs\\fR(1), ") +
         "the guides in /usr/share/doc/ftcs\n";
}

std::string bash_completion(const CLI::App& program) {
  return "# bash completion for ftcs; made of its option tables\n" + shell_tables(program) +
         R"(_ftcs() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} path='' word list
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] && break
    [[ -n $(_ftcs_words "${path:+$path }$word") ]] && path="${path:+$path }$word"
  done
  list=$(_ftcs_values "$path $previous")
  [[ -z $list ]] && list=$(_ftcs_words "$path")
  COMPREPLY=($(compgen -W "$list" -- "$current"))
}
complete -o bashdefault -o default -F _ftcs ftcs
)";
}

std::string zsh_completion(const CLI::App& program) {
  return "#compdef ftcs\n# made of the option tables of ftcs\n" + shell_tables(program) +
         R"(_ftcs() {
  local path_of_command='' word list
  for word in "${(@)words[2,CURRENT-1]}"; do
    [[ $word == -* ]] && break
    [[ -n $(_ftcs_words "${path_of_command:+$path_of_command }$word") ]] &&
      path_of_command="${path_of_command:+$path_of_command }$word"
  done
  list=$(_ftcs_values "$path_of_command ${words[CURRENT-1]}")
  [[ -z $list ]] && list=$(_ftcs_words "$path_of_command")
  compadd -- ${=list}
  [[ ${words[CURRENT]} == -* ]] || _files
}
if [[ ${funcstack[1]} == _ftcs ]]; then _ftcs "$@"; else compdef _ftcs ftcs; fi
)";
}

}  // namespace ftcs::app
