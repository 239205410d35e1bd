// SPDX-License-Identifier: MIT
// World: headless Chromium opens a report from disk; Debian's package chromium, else the test is
// skipped. The document after its scripts have run must hold the plots, and the console must be
// empty.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/report/html_report.h"
#include "ftcs/report/write_file.h"

namespace ftcs {
namespace {

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

HtmlReport report_of_every_kind() {
  HtmlReport report("Every kind of section", "<b>escaped</b> & \"quoted\"");
  report.add_figures("Figures", {{"RMS", "12.5 ns"}, {"max |TE|", "53.1 ns"}});
  std::vector<double> offsets(20000);
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    offsets[i] = 20.0 * std::sin(static_cast<double>(i * i % 1000)) + (i == 12345 ? 400.0 : 0.0);
  }
  offsets[5] = kNoFigure;
  Plot trace{"Offset", "time / s", "offset / ns", false, false, PlotStyle::kLine, {}, "One spike."};
  trace.series = {trace_series("</script><i>", offsets, 0.1, 1.0),
                  trace_series("b", offsets, 0.3, 2.0)};
  report.add_plot(trace);
  trace.title = "One of them again";
  trace.series.erase(trace.series.begin());
  report.add_plot(trace);
  Plot bars{"Histogram", "offset / ns", "samples", false, false, PlotStyle::kFilledSteps, {}, ""};
  bars.series = {histogram_series("samples", histogram(offsets), 1.0)};
  report.add_plot(bars);
  for (double& offset : offsets) offset *= 1e-9;
  const auto factors = octave_factors(offsets.size());
  Plot deviations{"Stability", "tau / s", "deviation", true, true, PlotStyle::kLineWithPoints,
                  {},          ""};
  for (const auto deviation : {Deviation::kOverlappingAllan, Deviation::kModifiedAllan}) {
    deviations.series.push_back(
        deviation_series(name(deviation), stability(deviation, {offsets, 0.1}, factors)));
  }
  report.add_plot(deviations);
  Plot wander{"MTIE", "tau / s", "MTIE / s", true, true, PlotStyle::kLineWithPoints, {}, ""};
  wander.series = {mtie_series("MTIE", mtie({offsets, 0.1}, factors))};
  report.add_plot(wander);
  report.add_parameters({{"seed", "1"}});
  return report;
}

TEST(HtmlReportInBrowser, opens_without_a_console_message_and_shows_its_plots) {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "chromium is not installed";
  }
  const auto folder = std::filesystem::path(::testing::TempDir()) / "ftcs_report_in_browser";
  std::filesystem::create_directories(folder);
  ASSERT_FALSE(write_file(folder / "report.html", report_of_every_kind().render()).has_value());
  const std::string command =
      "timeout 100 chromium --headless --no-sandbox --disable-gpu --user-data-dir='" +
      (folder / "profile").string() +
      "' --virtual-time-budget=5000 --enable-logging=stderr --dump-dom 'file://" +
      (folder / "report.html").string() + "' > '" + (folder / "dom").string() + "' 2> '" +
      (folder / "log").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << content(folder / "log");
  const std::string log = content(folder / "log");
  std::string dom = content(folder / "dom");
  dom.resize(dom.find("<script"));  // the library's own text would be counted too
  EXPECT_EQ(log.find("CONSOLE"), std::string::npos) << log;
  EXPECT_EQ(count(dom, "<canvas"), 10);  // dygraphs lays two over each other for every plot
  EXPECT_GT(count(dom, "dygraph-axis-label-x"), 8);
  EXPECT_GT(count(dom, "dygraph-axis-label-y"), 8);
  EXPECT_EQ(count(dom, "class=\"dygraph-legend-line\""), 7);
  const std::regex line_of_b(
      "color: ([^;\"]+)[^>]*>\\s*<div class=\"dygraph-legend-line\"[^>]*></div>\\s*b<");
  std::vector<std::string> colours;
  for (std::sregex_iterator at(dom.begin(), dom.end(), line_of_b), end; at != end; ++at) {
    colours.push_back((*at)[1]);
  }
  ASSERT_EQ(colours.size(), 2U) << dom;
  EXPECT_EQ(colours[0], colours[1]) << "one name, one colour";
  EXPECT_EQ(dom.find("<i>"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace ftcs
