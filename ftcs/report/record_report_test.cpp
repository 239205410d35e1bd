// SPDX-License-Identifier: MIT
// World: a steered clock with 20 ns of white noise at 8 Hz and one missing second.
#include "ftcs/report/record_report.h"

#include <gtest/gtest.h>

#include "test/support/noise_for_test.h"

namespace ftcs {
namespace {

Series offsets() {
  Series series;
  series.kind = RecordKind::kOffset;
  series.values = test::white_noise(2000, 20e-9, 3);
  for (std::size_t i = 800; i < 808; ++i) series.values[i] = kNoFigure;
  series.interval_s = 0.125;
  series.samples = 1992;
  series.missing = 8;
  series.notes = {"a <note>"};
  return series;
}

TEST(RecordReport, gives_the_figures_of_an_offset_record) {
  const AnalysedRecord record = analyse_series("log", offsets());
  const Json json = json_report(record);
  EXPECT_NEAR(json.at("summary").at("rms_ns").get<double>(), 20.0, 1.5);
  EXPECT_EQ(json.at("samples"), 1992);
  EXPECT_EQ(json.at("stability").at("oadev").at(0).at("tau_s"), 0.125);
  // White PM: ADEV = sqrt(3) sigma / tau.
  EXPECT_NEAR(json.at("stability").at("oadev").at(0).at("deviation").get<double>(), 2.77e-7,
              0.2e-7);
  EXPECT_EQ(json.at("stability").at("mdev").at(0).at("noise"), "white PM");
  EXPECT_GT(json.at("mtie").at(0).at("mtie_s").get<double>(), 60e-9);
}

TEST(RecordReport, integrates_a_frequency_record) {
  Series series = offsets();
  series.kind = RecordKind::kFrequency;
  const AnalysedRecord record = analyse_series("log", series);
  EXPECT_EQ(record.phase.size(), series.values.size() + 1);
  const Json json = json_report(record);
  EXPECT_NEAR(json.at("summary").at("rms_ppb").get<double>(), 20.0, 1.5);
  EXPECT_EQ(json.at("stability").at("oadev").at(0).at("noise"), "white FM");
}

TEST(RecordReport, has_a_row_for_each_tau_and_statistic) {
  const AnalysedRecord record = analyse_series("log", offsets());
  EXPECT_EQ(stability_table(record).rows().size(),
            record.analysis.points(Deviation::kOverlappingAllan).size());
  const std::string csv = stability_list(record).to_csv();
  EXPECT_EQ(csv.rfind("statistic,tau_s,value,lower,upper,terms,noise\noadev,0.125,", 0), 0U);
  EXPECT_NE(csv.find("\nmtie,0.125,"), std::string::npos);
  const std::string text = console_report(record);
  EXPECT_NE(text.find("white PM"), std::string::npos);
  EXPECT_NE(text.find("a <note>"), std::string::npos);
}

TEST(RecordReport, puts_every_plot_into_html) {
  const std::string html = html_report(analyse_series("log", offsets()));
  for (const char* title : {"Offset over time", "Rate over time", "Histogram",
                            "Frequency stability", "Time stability"}) {
    EXPECT_NE(html.find(std::string("<h2>") + title), std::string::npos) << title;
  }
  EXPECT_EQ(html.find("nothing to plot"), std::string::npos);
  EXPECT_NE(html.find("a &lt;note&gt;"), std::string::npos);
}

TEST(RecordReport, of_two_points_is_short_but_whole) {
  Series series;
  series.values = {0.0, 1e-9};
  series.samples = 2;
  const AnalysedRecord record = analyse_series("log", series);
  EXPECT_FALSE(console_report(record).empty());
  EXPECT_TRUE(json_report(record).at("stability").at("oadev").empty());
  EXPECT_NE(html_report(record).find("nothing to plot"), std::string::npos);
}

}  // namespace
}  // namespace ftcs
