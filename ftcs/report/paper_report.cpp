// SPDX-License-Identifier: MIT
#include "ftcs/report/paper_report.h"

#include <limits>

#include <fmt/format.h>

#include "ftcs/report/check_report.h"
#include "ftcs/report/html_report.h"
#include "ftcs/report/number_format.h"

namespace ftcs {
namespace {

using experiment::PaperResult;
using experiment::PaperRow;
using experiment::PaperRowResult;

Json row_json(const PaperResult& result, std::size_t i) {
  const PaperRow& row = result.table.rows[i];
  const PaperRowResult& figures = result.rows[i];
  return Json{{"row", row.key()},
              {"paper_rms_ns", number(row.paper_rms_ns)},
              {"rms_perceived_offset_ns", number(figures.rms_perceived_ns)},
              {"median_rms_ns", number(figures.median_rms_ns)},
              {"rms_time_error_ns", number(figures.rms_true_ns)},
              {"predicted_rms_ns", number(figures.predicted_rms_ns)},
              {"paper_cycles", number(row.paper_cycles)},
              {"cycles_to_converge", number(figures.median_cycles)},
              {"passed", row_passed(result.checks, row.key())},
              {"note", row.note},
              {"model_rms_ns", number(row.model_rms_ns)},
              {"deviation_ns", number(figures.deviation_ns)},
              {"percentile_5_ns", number(figures.percentile_5_ns)},
              {"percentile_95_ns", number(figures.percentile_95_ns)},
              {"cycles_percentile_5", number(figures.percentile_5_cycles)},
              {"cycles_percentile_95", number(figures.percentile_95_cycles)},
              {"cycles_from_first_message", number(figures.median_cycles_from_first_message)},
              {"published_seed_rms_ns", number(figures.published.rms_perceived_ns)},
              {"runs", figures.runs.size()}};
}

/// The published runs in the cycles from `first` to before `last`.
Plot figure_plot(const PaperResult& result, const char* part, std::size_t first, std::size_t last) {
  Plot plot;
  plot.title = fmt::format("{}, {}: perceived offset, seed {}", result.table.figure, part,
                           result.table.published_seed);
  plot.x_label = "cycle";
  plot.y_label = "local minus reference / ns";
  for (const auto& trace : result.traces) {
    PlotSeries series{trace.row, {}, {}, {}, {}};
    for (std::size_t n = first; n < trace.perceived_offset_ns.size() && n < last; ++n) {
      series.x.push_back(static_cast<double>(n));
      series.y.push_back(trace.perceived_offset_ns[n]);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

/// Most of the plot would be the start's microseconds otherwise.
void add_figure(HtmlReport& report, const PaperResult& result) {
  if (result.traces.empty()) return;
  const std::size_t settled = result.table.measure_from;
  report.add_plot(figure_plot(result, "start", 0, settled));
  report.add_plot(figure_plot(result, "settled", settled, std::numeric_limits<std::size_t>::max()));
}

}  // namespace

std::string algorithm_text() {
  return "Table 1: the modified FTCS, as it runs (offset = local - reference, T_offset = -offset)\n"
         "\n"
         "  at sample n:\n"
         "    k(n) a_l  = reference elapsed / free running elapsed                       (12), "
         "(13)\n"
         "    inside    = |T_offset| < B_enter for `dwell` samples; until |T_offset| >= B_leave\n"
         "    p(n)      = inside ? p : 1                                                 (19) : "
         "(18)\n"
         "    a_l(n+1)  = (1 + p(n) T_offset / T_c) k(n) a_l  for T_c, then k(n) a_l     (17)\n"
         "    a_l(n+1)  limited to F; T_c = T_sync unless it is set shorter\n"
         "  The first command comes with the second sample; the clock is never stepped.\n";
}

Table paper_table(const PaperResult& result) {
  Table table({"row", "paper / ns", "ours / ns", "ratio", "median", "5 %", "95 %", "true / ns",
               "closed form", "cycles: paper", "ours"});
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    const PaperRow& row = result.table.rows[i];
    const PaperRowResult& f = result.rows[i];
    table.add_row(
        {row.key(), Cell::significant(row.paper_rms_ns, 5), Cell::significant(f.rms_perceived_ns),
         Cell::fixed(f.rms_perceived_ns / row.paper_rms_ns, 3), Cell::significant(f.median_rms_ns),
         Cell::significant(f.percentile_5_ns), Cell::significant(f.percentile_95_ns),
         Cell::significant(f.rms_true_ns), Cell::significant(f.predicted_rms_ns),
         Cell::significant(row.paper_cycles, 3),
         std::isinf(f.median_cycles) ? Cell("never") : Cell::significant(f.median_cycles, 3)});
  }
  return table;
}

std::string paper_console(const PaperResult& result) {
  const auto& table = result.table;
  std::string text = fmt::format(
      "{}\n{} seeds from {} on; {}\n\n", table.title, table.seeds, table.first_seed,
      "RMS of the perceived offset (the paper's \"SSE\") over all seeds; true = time error");
  text += paper_table(result).to_text() + "\n";
  for (const auto& row : table.rows) {
    if (!row.note.empty()) text += fmt::format("{}: {}\n", row.key(), row.note);
  }
  for (const auto& remark : table.remarks) text += remark + "\n";
  text += "\n" + choices_table(result.table.choices).to_text() + "\n" +
          checks_table(result.checks).to_text() + "\n";
  for (const auto& check : result.checks) {
    if (!check.note.empty())
      text += fmt::format("{} ({}): {}\n", check.name, check.subject, check.note);
  }
  return text;
}

Json paper_json(const std::vector<PaperResult>& results, const std::string& version,
                bool complete) {
  Json tables = Json::object();
  Json support = Json::object();
  Json figures = Json::object();
  Json checks = Json::array();
  Json choices = Json::array();
  bool passed = complete;
  for (const PaperResult& result : results) {
    passed = passed && result.passed();
    Json& rows = tables[result.table.table] = Json::array();
    Json& others = support[result.table.table] = Json::array();
    for (std::size_t i = 0; i < result.rows.size(); ++i) {
      (result.table.rows[i].support ? others : rows).push_back(row_json(result, i));
    }
    append_checks(checks, result.table.table, result.checks);
    append_choices(choices, result.table.table, result.table.choices);
    for (const auto& trace : result.traces) {
      figures[result.table.figure].push_back({{"row", trace.row},
                                              {"interval_ns", trace.interval_ns},
                                              {"seed", result.table.published_seed},
                                              {"perceived_offset_ns", trace.perceived_offset_ns},
                                              {"time_error_ns", trace.time_error_ns}});
    }
  }
  return Json{{"program", "ftcs"},
              {"version", version},
              {"complete", complete},
              {"passed", passed},
              {"tables", std::move(tables)},
              {"checks", std::move(checks)},
              {"choices", std::move(choices)},
              {"support", std::move(support)},
              {"figures", std::move(figures)}};
}

std::string paper_html(const std::vector<PaperResult>& results, const std::string& version) {
  HtmlReport report("Frequency-tracking clock servo: Section IV regenerated",
                    "Chen et al., IEEE Access 5 (2017), DOI 10.1109/ACCESS.2017.2715878");
  for (const PaperResult& result : results) {
    report.add_table(
        result.table.title, paper_table(result),
        fmt::format("{} seeds from {} on", result.table.seeds, result.table.first_seed));
    for (const auto& remark : result.table.remarks) report.add_note(remark);
    add_figure(report, result);
    report.add_table("Choices", choices_table(result.table.choices));
    report.add_table("Checks", checks_table(result.checks));
  }
  report.add_parameters({{"version", version}});
  return report.render();
}

Table paper_csv(const std::vector<PaperResult>& results) {
  Table table({"table", "row", "paper_rms_ns", "rms_perceived_offset_ns", "median_rms_ns",
               "rms_time_error_ns", "predicted_rms_ns", "paper_cycles", "cycles_to_converge"});
  for (const PaperResult& result : results) {
    for (std::size_t i = 0; i < result.rows.size(); ++i) {
      const PaperRow& row = result.table.rows[i];
      const PaperRowResult& f = result.rows[i];
      table.add_row({result.table.table, row.key(), Cell::significant(row.paper_rms_ns),
                     Cell::significant(f.rms_perceived_ns), Cell::significant(f.median_rms_ns),
                     Cell::significant(f.rms_true_ns), Cell::significant(f.predicted_rms_ns),
                     Cell::significant(row.paper_cycles), Cell::significant(f.median_cycles)});
    }
  }
  return table;
}

}  // namespace ftcs
