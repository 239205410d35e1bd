// SPDX-License-Identifier: MIT
// World: the text of a report; what a browser makes of it: html_report_browser_test.cpp.
#include "ftcs/report/html_report.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

Plot long_plot(const std::string& name) {
  std::vector<double> values(200000);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = std::sin(static_cast<double>(i) * 1e-3) * M_PI;
  Plot plot;
  plot.title = name;
  plot.series = {trace_series(name, values, 1.0 / 3.0, 1.0)};
  return plot;
}

TEST(HtmlReport, asks_nothing_of_the_network) {
  HtmlReport report("title");
  report.add_plot(long_plot("x"));
  const std::string html = report.render();
  EXPECT_EQ(html.find(" src="), std::string::npos);
  EXPECT_EQ(html.find("<link"), std::string::npos);
  EXPECT_EQ(html.find("@import"), std::string::npos);
  EXPECT_EQ(html.find("sourceMappingURL"), std::string::npos);
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
}

TEST(HtmlReport, holds_the_plotting_library_and_stays_small) {
  HtmlReport report("title");
  for (int i = 0; i < 8; ++i) report.add_plot(long_plot("trace"));
  const std::string html = report.render();
  EXPECT_NE(html.find("dygraphs/blob/v2"), std::string::npos);  // its licence line
  EXPECT_LT(html.size(), 3000000U);
}

TEST(HtmlReport, escapes_every_text) {
  const std::string evil = "</script><script>alert(1)</script><b a='\"'>&";
  HtmlReport report(evil, evil);
  report.add_figures(evil, {{evil, evil}});
  Table table({evil});
  table.add_row({evil});
  report.add_table(evil, table, evil);
  report.add_parameters({{evil, evil}});
  report.add_note(evil);
  const std::string before = HtmlReport("x").render();
  Plot plot = long_plot(evil);
  plot.x_label = plot.y_label = plot.note = evil;
  report.add_plot(plot);
  const std::string html = report.render();
  EXPECT_EQ(html.find("<script>alert"), std::string::npos);
  EXPECT_EQ(html.find("<b a="), std::string::npos);
  const auto count = [](const std::string& text, const std::string& part) {
    int found = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count(html, "</script"), count(before, "</script"));
  EXPECT_EQ(escape_html("<&>\"'"), "&lt;&amp;&gt;&quot;&#39;");
}

TEST(HtmlReport, shows_its_sections_in_order) {
  HtmlReport report("title");
  report.add_note("first");
  report.add_plot(long_plot("second"));
  report.add_parameters({{"seed", "third"}});
  const std::string html = report.render();
  EXPECT_LT(html.find("<p>first"), html.find("<h2>second"));
  EXPECT_LT(html.find("<h2>second"), html.find("<td>third"));
}

TEST(HtmlReport, says_so_when_there_is_nothing_to_plot) {
  HtmlReport report("title");
  Plot empty;
  empty.title = "ADEV";
  report.add_plot(empty);
  EXPECT_NE(report.render().find("nothing to plot"), std::string::npos);
  EXPECT_NE(report.render().find("id=\"plots\">[]</script>"), std::string::npos);
}

TEST(HtmlReport, gives_series_of_one_name_different_labels) {
  Plot plot = long_plot("same");
  plot.series.push_back(plot.series[0]);
  HtmlReport report("title");
  report.add_plot(plot);
  EXPECT_NE(report.render().find("same (2)"), std::string::npos);
}

}  // namespace
}  // namespace ftcs
