// SPDX-License-Identifier: MIT
#include "ftcs/report/check_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "ftcs/report/number_format.h"

namespace ftcs {
namespace {

using experiment::PaperCheckResult;
using experiment::PaperChoice;

/// The interval on one side only is "at least" or "at most".
std::string demand_text(const PaperCheckResult& check) {
  if (std::isnan(check.least) && std::isnan(check.most)) {
    return std::isnan(check.expected) ? "" : fmt::format("about {}", significant(check.expected));
  }
  if (std::isnan(check.most)) return fmt::format(">= {}", significant(check.least));
  if (std::isnan(check.least)) return fmt::format("<= {}", significant(check.most));
  if (check.least == check.most) return fmt::format("= {}", significant(check.least));
  return fmt::format("{} .. {}", significant(check.least), significant(check.most));
}

std::string verdict(const PaperCheckResult& check) {
  if (!check.demanded) return "report";
  return check.passed ? "ok" : "FAILED";
}

}  // namespace

Table checks_table(const std::vector<PaperCheckResult>& checks) {
  Table table({"check", "row", "against", "demanded", "measured", ""});
  for (const PaperCheckResult& check : checks) {
    table.add_row({check.name, check.subject, check.against, demand_text(check),
                   Cell::significant(check.measured, 5), verdict(check)});
  }
  return table;
}

Table choices_table(const std::vector<PaperChoice>& choices) {
  Table table({"the paper does not say", "chosen", "because"});
  for (const PaperChoice& choice : choices) {
    table.add_row({choice.parameter, choice.value, choice.reason});
  }
  return table;
}

void append_checks(Json& array, const std::string& table,
                   const std::vector<PaperCheckResult>& checks) {
  for (const PaperCheckResult& check : checks) {
    array.push_back({{"table", table},
                     {"name", check.name},
                     {"subject", check.subject},
                     {"against", check.against},
                     {"expected", number(check.expected)},
                     {"least", number(check.least)},
                     {"most", number(check.most)},
                     {"measured", number(check.measured)},
                     {"demanded", check.demanded},
                     {"passed", check.passed},
                     {"note", check.note}});
  }
}

void append_choices(Json& array, const std::string& table,
                    const std::vector<PaperChoice>& choices) {
  for (const PaperChoice& choice : choices) {
    array.push_back({{"table", table},
                     {"parameter", choice.parameter},
                     {"value", choice.value},
                     {"reason", choice.reason}});
  }
}

bool row_passed(const std::vector<PaperCheckResult>& checks, const std::string& row) {
  return std::all_of(checks.begin(), checks.end(), [&row](const PaperCheckResult& check) {
    return check.subject != row || check.passed;
  });
}

}  // namespace ftcs
