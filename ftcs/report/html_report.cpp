// SPDX-License-Identifier: MIT
#include "ftcs/report/html_report.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "ftcs/report/embedded_assets.h"
#include "ftcs/report/json.h"

namespace ftcs {
namespace {

/// Enough for one point per pixel of a wide screen and extremes; keeps a report of six plots below
/// 1 MB.
constexpr std::size_t kMostPointsPerPlot = 8000;
/// Digits that the reader sees when pointing at a value, and two more for zooming.
constexpr int kDigitsOfValues = 8;
/// A day of samples at 10 kHz is told apart by ten digits.
constexpr int kDigitsOfAxis = 12;

/// Shortest text for the rounded numbers: a report is read, not computed with.
Json numbers(const std::vector<double>& values, int digits) {
  Json array = Json::array();
  for (const double value : values) {
    array.push_back(std::isfinite(value)
                        ? std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr)
                        : value);
  }
  return array;
}

const char* style_name(PlotStyle style) {
  switch (style) {
    case PlotStyle::kLine:
      return "line";
    case PlotStyle::kLineWithPoints:
      return "points";
    case PlotStyle::kFilledSteps:
      return "steps";
  }
  return "line";
}

bool has_points(const Plot& plot) {
  return std::any_of(plot.series.begin(), plot.series.end(), [](const PlotSeries& series) {
    return std::any_of(series.y.begin(), series.y.end(), [](double y) { return std::isfinite(y); });
  });
}

/// Labels are keys in dygraphs: two series of one name would be one.
std::vector<std::string> distinct_names(const Plot& plot) {
  std::vector<std::string> names{plot.x_label};
  for (const PlotSeries& series : plot.series) {
    std::string name = series.name;
    for (int copy = 2; std::find(names.begin(), names.end(), name) != names.end(); ++copy) {
      name = fmt::format("{} ({})", series.name, copy);
    }
    names.push_back(name);
  }
  names.erase(names.begin());
  return names;
}

Json plot_json(const Plot& plot) {
  Json json;
  json["x_label"] = plot.x_label;
  json["y_label"] = plot.y_label;
  json["log_x"] = plot.log_x;
  json["log_y"] = plot.log_y;
  json["y_extent"] = plot.y_extent;
  json["style"] = style_name(plot.style);
  json["bands"] = std::any_of(plot.series.begin(), plot.series.end(),
                              [](const PlotSeries& series) { return !series.lower.empty(); });
  const auto names = distinct_names(plot);
  Json all = Json::array();
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const PlotSeries& whole = plot.series[i];
    const PlotSeries series = whole.lower.empty()
                                  ? downsample(whole, kMostPointsPerPlot / 2 / plot.series.size())
                                  : whole;
    all.push_back({{"name", names[i]},
                   {"x", numbers(series.x, kDigitsOfAxis)},
                   {"y", numbers(series.y, kDigitsOfValues)},
                   {"lower", numbers(series.lower, kDigitsOfValues)},
                   {"upper", numbers(series.upper, kDigitsOfValues)}});
  }
  json["series"] = std::move(all);
  return json;
}

/// JSON inside a script element: "<" would let a name close it.
std::string safe_in_script(const std::string& json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char byte : json) {
    if (byte == '<') {
      safe += "\\u003c";
    } else {
      safe += byte;
    }
  }
  return safe;
}

}  // namespace

std::string escape_html(const std::string& text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char byte : text) {
    switch (byte) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += byte;
    }
  }
  return escaped;
}

void HtmlReport::add_figures(const std::string& heading, const std::vector<LabelledText>& figures) {
  body_ += fmt::format("<section><h2>{}</h2><dl class=\"figures\">\n", escape_html(heading));
  for (const auto& [label, value] : figures) {
    body_ +=
        fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", escape_html(label), escape_html(value));
  }
  body_ += "</dl></section>\n";
}

void HtmlReport::add_plot(const Plot& plot) {
  body_ += fmt::format("<section><h2>{}</h2>\n", escape_html(plot.title));
  if (has_points(plot)) {
    body_ += fmt::format(
        "<div class=\"legend\" id=\"legend{0}\"></div><div class=\"plot\" id=\"plot{0}\"></div>\n",
        plot_count_);
    if (plot_count_ > 0) plots_ += ",\n";
    plots_ += plot_json(plot).dump(-1, ' ', false, Json::error_handler_t::replace);
    ++plot_count_;
  } else {
    body_ += "<p class=\"note\">There is nothing to plot: the record is too short.</p>\n";
  }
  if (!plot.note.empty())
    body_ += fmt::format("<p class=\"note\">{}</p>\n", escape_html(plot.note));
  body_ += "</section>\n";
}

void HtmlReport::add_table(const std::string& heading, const Table& table,
                           const std::string& note) {
  body_ += fmt::format("<section><h2>{}</h2><div class=\"scroll\"><table><thead><tr>",
                       escape_html(heading));
  std::vector<const char*> classes;
  for (std::size_t column = 0; column < table.headings().size(); ++column) {
    classes.push_back(table.right_justified(column) ? " class=\"right\"" : "");
    body_ += fmt::format("<th{}>{}</th>", classes[column], escape_html(table.headings()[column]));
  }
  body_ += "</tr></thead><tbody>\n";
  for (const auto& row : table.rows()) {
    body_ += "<tr>";
    for (std::size_t column = 0; column < row.size(); ++column) {
      body_ += fmt::format("<td{}>{}</td>", classes[column], escape_html(row[column].text));
    }
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>";
  if (!note.empty()) body_ += fmt::format("<p class=\"note\">{}</p>", escape_html(note));
  body_ += "</section>\n";
}

void HtmlReport::add_parameters(const std::vector<LabelledText>& parameters) {
  Table table({"Parameter", "Value"});
  for (const auto& [label, value] : parameters) table.add_row({label, value});
  add_table("Parameters", table);
}

void HtmlReport::add_note(const std::string& text, bool warning) {
  body_ += fmt::format("<section{}><p>{}</p></section>\n", warning ? " class=\"warning\"" : "",
                       escape_html(text));
}

std::string HtmlReport::render() const {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html +=
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
      "'unsafe-inline'; "
      "style-src 'unsafe-inline'; img-src data:\">\n";
  html += "<title>" + escape_html(title_) + "</title>\n<style>\n";
  append_dygraph_css(html);
  append_report_css(html);
  html += "</style>\n</head>\n<body>\n<header><h1>" + escape_html(title_) + "</h1><p>" +
          escape_html(subtitle_) + "</p></header>\n<main>\n";
  html +=
      "<noscript><section class=\"warning\"><p>The plots need JavaScript; figures and tables do "
      "not.</p></section></noscript>\n";
  html += body_;
  html +=
      "</main>\n<footer><p>Drag in a plot to zoom, shift and drag to move, double click to see "
      "all. Plots: dygraphs "
      "(MIT licence). Made by ftcs.</p></footer>\n";
  html += "<script type=\"application/json\" id=\"plots\">[" + safe_in_script(plots_) +
          "]</script>\n<script>\n";
  append_dygraph_js(html);
  html += "\n</script>\n<script>\n";
  append_report_js(html);
  html += "</script>\n</body>\n</html>\n";
  return html;
}

}  // namespace ftcs
