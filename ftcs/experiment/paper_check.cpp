// SPDX-License-Identifier: MIT
#include "ftcs/experiment/paper_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ftcs/analysis/statistics.h"

namespace ftcs::experiment {
namespace {

class Judge {
 public:
  explicit Judge(const PaperResult& result) : result_(result) {}

  std::vector<PaperCheckResult> judge(const PaperCheck& check) const {
    if (check.figure == CheckFigure::kSpread) return {judge_spread(check)};
    std::vector<PaperCheckResult> lines;
    for (std::size_t i = 0; i < check.rows.size(); ++i) lines.push_back(judge_row(check, i));
    return lines;
  }

 private:
  [[nodiscard]] std::size_t index_of(const std::string& key) const {
    const auto& rows = result_.table.rows;
    const auto found = std::find_if(rows.begin(), rows.end(),
                                    [&](const PaperRow& row) { return row.key() == key; });
    return static_cast<std::size_t>(found - rows.begin());
  }
  [[nodiscard]] const PaperRowResult& figures(const std::string& key) const {
    return result_.rows[index_of(key)];
  }

  /// Figures of run pairs with common noise.
  template <class Combine>
  [[nodiscard]] std::vector<double> paired(const std::string& a, const std::string& b,
                                           Combine combine) const {
    std::vector<double> values;
    const auto& first = figures(a).runs;
    const auto& second = figures(b).runs;
    for (std::size_t i = 0; i < first.size(); ++i) {
      if (first[i].done && second[i].done) values.push_back(combine(first[i], second[i]));
    }
    std::sort(values.begin(), values.end());
    return values;
  }

  [[nodiscard]] double measure(const PaperCheck& check, std::size_t i) const {
    const PaperRowResult& row = figures(check.rows[i]);
    const auto partner = [&]() -> const std::string& {
      return check.over[std::min(i, check.over.size() - 1)];
    };
    switch (check.figure) {
      case CheckFigure::kRms:
        return row.rms_perceived_ns;
      case CheckFigure::kMedian:
        return row.median_rms_ns;
      case CheckFigure::kTrueRms:
        return row.rms_true_ns;
      case CheckFigure::kDeviation:
        return row.deviation_ns;
      case CheckFigure::kCycles:
        return row.median_cycles;
      case CheckFigure::kSeedRms:
      case CheckFigure::kSeedExact:
        return row.published.rms_perceived_ns;
      case CheckFigure::kRatio:
        return row.rms_perceived_ns / figures(partner()).rms_perceived_ns;
      case CheckFigure::kMedianRatio:
        return quantile_of_sorted(paired(check.rows[i], partner(),
                                         [](const PaperSeedRun& a, const PaperSeedRun& b) {
                                           return a.rms_perceived_ns / b.rms_perceived_ns;
                                         }),
                                  0.5);
      case CheckFigure::kProbability: {
        const auto wins =
            paired(check.rows[i], partner(), [](const PaperSeedRun& a, const PaperSeedRun& b) {
              return a.rms_perceived_ns < b.rms_perceived_ns ? 1.0 : 0.0;
            });
        double sum = 0.0;
        for (const double win : wins) sum += win;
        return sum / static_cast<double>(wins.size());
      }
      case CheckFigure::kSettlingTime: {
        const double a =
            row.median_cycles * result_.table.rows[index_of(check.rows[i])].world.interval.ns();
        const double b = figures(partner()).median_cycles *
                         result_.table.rows[index_of(partner())].world.interval.ns();
        return a / b;
      }
      case CheckFigure::kSpread:
        break;
    }
    return kNotGiven;
  }

  [[nodiscard]] double expectation(const PaperCheck& check, std::size_t i) const {
    if (!check.expect_from_row) return check.expected[std::min(i, check.expected.size() - 1)];
    const PaperRow& row = result_.table.rows[index_of(check.rows[i])];
    if (check.figure == CheckFigure::kCycles) return row.paper_cycles;
    return check.against == "paper" ? row.paper_rms_ns : row.model_rms_ns;
  }

  [[nodiscard]] static PaperCheckResult line(const PaperCheck& check, std::string subject) {
    PaperCheckResult result;
    result.name = check.name;
    result.subject = std::move(subject);
    result.against = check.against;
    result.demanded = check.demanded;
    result.note = check.note;
    return result;
  }

  static void decide(PaperCheckResult& result) {
    const bool in_limits = !(result.measured < result.least) && !(result.measured > result.most) &&
                           !std::isnan(result.measured);
    result.passed = in_limits || !result.demanded;
  }

  [[nodiscard]] PaperCheckResult judge_row(const PaperCheck& check, std::size_t i) const {
    std::string subject = check.rows[i];
    if (!check.over.empty()) subject += " / " + check.over[std::min(i, check.over.size() - 1)];
    PaperCheckResult result = line(check, std::move(subject));
    result.measured = measure(check, i);
    result.expected = expectation(check, i);
    result.least = check.least;
    result.most = check.most;
    if (check.figure == CheckFigure::kSeedExact) {
      result.least = result.most = result.expected;
    } else if (!std::isnan(check.relative_tolerance)) {
      result.least = result.expected * (1.0 - check.relative_tolerance);
      result.most = result.expected * (1.0 + check.relative_tolerance);
    } else if (!std::isnan(check.plus) || !std::isnan(check.minus)) {
      result.least = result.expected - (std::isnan(check.minus) ? 0.0 : check.minus);
      result.most = result.expected + (std::isnan(check.plus) ? 0.0 : check.plus);
    }
    decide(result);
    return result;
  }

  [[nodiscard]] PaperCheckResult judge_spread(const PaperCheck& check) const {
    std::string subject;
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (const auto& key : check.rows) {
      subject += (subject.empty() ? "" : "; ") + key;
      least = std::min(least, figures(key).rms_perceived_ns);
      most = std::max(most, figures(key).rms_perceived_ns);
    }
    PaperCheckResult result = line(check, std::move(subject));
    result.measured = most / least;
    result.least = check.least;
    result.most = check.most;
    decide(result);
    return result;
  }

  const PaperResult& result_;
};

}  // namespace

std::vector<PaperCheckResult> judge_paper_table(const PaperResult& result) {
  const Judge judge(result);
  std::vector<PaperCheckResult> lines;
  for (const auto& check : result.table.checks) {
    for (auto& line : judge.judge(check)) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace ftcs::experiment
