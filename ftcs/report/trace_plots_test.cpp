// SPDX-License-Identifier: MIT
// World: two traces made by hand, ten samples a cycle, a window from cycle 5 on.
#include "ftcs/report/trace_plots.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

experiment::RunTrace trace(const char* name, double size_ns) {
  experiment::RunTrace trace;
  trace.servo = name;
  trace.interval_s = 2.0;
  for (int i = 0; i < 1000; ++i) {
    trace.time_s.push_back(0.2 * i);
    trace.time_error_ns.push_back(i < 50 ? 1e6 : size_ns * (i % 2 == 0 ? 1.0 : -1.0));
    trace.rate_error_ppb.push_back(i);
  }
  trace.first_measured = 50;
  return trace;
}

const Plot& named(const std::vector<Plot>& plots, const std::string& beginning) {
  for (const Plot& plot : plots) {
    if (plot.title.starts_with(beginning)) return plot;
  }
  ADD_FAILURE() << beginning;
  return plots.front();
}

TEST(TracePlots, show_the_start_apart_from_the_window) {
  const auto plots = trace_plots({trace("a", 10.0), trace("b", 300.0)});
  ASSERT_EQ(plots.size(), 6U);
  const Plot& start = named(plots, "The start");
  EXPECT_TRUE(start.log_y);
  EXPECT_EQ(start.series[0].y.front(), 1e6);
  EXPECT_EQ(start.series[0].x.back(), 60.0);  // cycles of 2 s
  const Plot& error = named(plots, "True time error");
  ASSERT_EQ(error.series.size(), 2U);
  EXPECT_EQ(error.series[0].y.size(), 950U);
  EXPECT_EQ(error.series[0].x.front(), 10.0);
  EXPECT_EQ(named(plots, "Rate error").series[1].y.front(), 50.0);
}

TEST(TracePlots, distribution_tdev_and_mtie_are_of_the_window_alone) {
  const auto plots = trace_plots({trace("a", 10.0)});
  const PlotSeries& shares = named(plots, "Histogram").series[0];
  ASSERT_EQ(shares.y.size(), 3U);  // one bin, an empty one on either side
  EXPECT_EQ(shares.y[1], 100.0);
  EXPECT_NEAR(shares.x[1], 11.0, 0.1);  // the middle of the bin that begins at 10 ns
  EXPECT_NEAR(named(plots, "MTIE").series[0].y.front(), 20e-9, 1e-15);
  EXPECT_FALSE(named(plots, "TDEV").series[0].y.empty());
}

TEST(TracePlots, irregular_times_have_no_tau) {
  experiment::RunTrace irregular = trace("a", 10.0);
  for (std::size_t i = 0; i < irregular.time_s.size(); i += 3) irregular.time_s[i] += 0.05;
  EXPECT_EQ(trace_plots({irregular}).size(), 4U);
  EXPECT_TRUE(trace_plots({}).empty());
}

TEST(TracePlots, csv_has_a_row_for_each_sample_of_each_servo) {
  auto first = trace("a", 10.0);
  first.time_s.resize(2);
  const std::string csv = trace_csv({first, trace("b,c", 300.0)});
  EXPECT_TRUE(
      csv.starts_with("servo,time_s,time_error_ns,rate_error_ppb\na,0,1000000,0\na,0.2,1000000,"
                      "1\n\"b,c\",0,1000000,0\n"))
      << csv.substr(0, 200);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 2 + 1000);
}

}  // namespace
}  // namespace ftcs
