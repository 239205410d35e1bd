// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "ftcs/report/plot.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// A label and what stands behind it.
using LabelledText = std::pair<std::string, std::string>;

/// One HTML file that holds everything it needs: styles, scripts (dygraphs, MIT licence) and data.
/// It asks nothing of the network (a Content-Security-Policy forbids it), follows the reader's
/// light or dark scheme, and shows its sections in the order in which they were added.
///
/// Every text is escaped on its way out: names of files and series may hold anything.
class HtmlReport {
 public:
  explicit HtmlReport(std::string title, std::string subtitle = {})
      : title_(std::move(title)), subtitle_(std::move(subtitle)) {}

  /// Headline figures, large.
  void add_figures(const std::string& heading, const std::vector<LabelledText>& figures);
  /// A plot without a single finite point is replaced by a sentence. Series above
  /// kMostPointsPerPlot points together are thinned by downsample().
  void add_plot(const Plot& plot);
  void add_table(const std::string& heading, const Table& table, const std::string& note = {});
  /// Parameters, seed, version: what is needed to get the same report again.
  void add_parameters(const std::vector<LabelledText>& parameters);
  /// A paragraph; a warning is marked by a coloured edge.
  void add_note(const std::string& text, bool warning = false);

  [[nodiscard]] std::string render() const;

 private:
  std::string title_;
  std::string subtitle_;
  std::string body_;
  std::string plots_;  // JSON objects, separated by commas
  std::size_t plot_count_ = 0;
};

/// Text for element content and quoted attributes: & < > " ' as entities.
[[nodiscard]] std::string escape_html(const std::string& text);

}  // namespace ftcs
