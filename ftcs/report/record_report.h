// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/analysis/record_analysis.h"
#include "ftcs/record/series_reader.h"
#include "ftcs/report/html_report.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// One analysed file, ready to be shown in any form.
struct AnalysedRecord {
  std::string file;
  Series series;
  /// series.values, or their integral if they are frequencies; seconds.
  std::vector<double> phase;
  RecordAnalysis analysis;
  double confidence = kOneSigmaConfidence;
};

[[nodiscard]] AnalysedRecord analyse_series(std::string file, Series series,
                                            const AnalysisOptions& options = {});

/// Headline figures: samples, span, mean frequency; of offsets and phases mean, RMS, percentiles,
/// max |TE|.
[[nodiscard]] std::vector<LabelledText> headline_figures(const AnalysedRecord& record);
/// One row for each tau: the first statistic with its interval, the others, MTIE, noise.
[[nodiscard]] Table stability_table(const AnalysedRecord& record);
/// One row for each statistic and tau: statistic, tau_s, value, lower, upper, terms, noise.
[[nodiscard]] Table stability_list(const AnalysedRecord& record);

/// The whole as text for the console.
[[nodiscard]] std::string console_report(const AnalysedRecord& record);
/// Field names: docs/analyse.md.
[[nodiscard]] Json json_report(const AnalysedRecord& record);
[[nodiscard]] std::string html_report(const AnalysedRecord& record);

}  // namespace ftcs
