// SPDX-License-Identifier: MIT
// World: the subcommand as the shell calls it, with files in a scratch folder.
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include "apps/ftcs/commands.h"

namespace ftcs::app {
namespace {

class AnalyseCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("ftcs_analyse_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    std::ofstream(file("offsets.csv")) << "time_s,offset_ns\n0,5\n1,-3\n2,4\n3,0\n4,1\n5,-2\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string file(const std::string& name) const {
    return (folder_ / name).string();
  }

  /// The exit code; kUsageError when the command line itself is refused. What it said is in output_
  /// and errors_.
  int run(std::vector<std::string> arguments) {
    CLI::App app;
    int code = kSuccess;
    add_analyse_command(app, code);
    std::reverse(arguments.begin(), arguments.end());
    arguments.emplace_back("analyse");
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    try {
      app.parse(arguments);
    } catch (const CLI::Error&) {
      code = kUsageError;
    }
    output_ = ::testing::internal::GetCapturedStdout();
    errors_ = ::testing::internal::GetCapturedStderr();
    return code;
  }

  static std::string content(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder_;
  std::string output_;
  std::string errors_;
};

TEST_F(AnalyseCommand, prints_figures_and_writes_every_form) {
  EXPECT_EQ(
      run({file("offsets.csv"), "--json", file("j"), "--csv", file("c"), "--html", file("h")}),
      kSuccess);
  EXPECT_NE(output_.find("OADEV"), std::string::npos);
  EXPECT_TRUE(errors_.empty());
  EXPECT_NE(content(file("j")).find("\"rms_ns\": 3.02"), std::string::npos) << content(file("j"));
  EXPECT_EQ(content(file("c")).rfind("statistic,", 0), 0U);
  EXPECT_NE(content(file("h")).find("Offset over time"), std::string::npos);
}

TEST_F(AnalyseCommand, leaves_with_2_when_it_is_called_wrongly) {
  EXPECT_EQ(run({}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--kind", "colour"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--interval", "-1"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--confidence", "1"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--unit", "furlong"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--time-unit", "h"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--time-unit", "ppm"}), kUsageError);
  EXPECT_EQ(run({file("offsets.csv"), "--time-unit", "d", "--unit", "us"}), kSuccess);
}

TEST_F(AnalyseCommand, computes_the_statistics_and_taus_that_it_is_asked_for) {
  std::ofstream values(file("phase.txt"));
  for (int i = 0; i < 200; ++i) values << (i * 7919 % 101) * 1e-9 << '\n';
  values.close();
  EXPECT_EQ(run({file("phase.txt"), "--deviation", "totdev,mtotdev", "--taus", "1,10,50", "--csv",
                 file("c"), "-q"}),
            kSuccess);
  const std::string list = content(file("c"));
  EXPECT_NE(list.find("\ntotdev,1,"), std::string::npos) << list;
  EXPECT_NE(list.find("\ntotdev,10,"), std::string::npos);
  EXPECT_NE(list.find("\nmtotdev,50,"), std::string::npos);
  EXPECT_EQ(list.find("oadev"), std::string::npos);
  EXPECT_EQ(list.find("totdev,2,"), std::string::npos);
  EXPECT_EQ(run({file("phase.txt"), "--deviation", "all", "--taus", "decade"}), kSuccess);
  for (const char* title : {"ADEV", "HTOTDEV", "TTOTDEV / s"})
    EXPECT_NE(output_.find(title), std::string::npos) << title;
  EXPECT_EQ(run({file("phase.txt"), "--deviation", "OADEV"}), kUsageError);
  EXPECT_NE(errors_.find("one of"), std::string::npos);
  EXPECT_EQ(run({file("phase.txt"), "--taus", "often"}), kUsageError);
  EXPECT_NE(errors_.find("got often"), std::string::npos);
  EXPECT_EQ(run({file("phase.txt"), "--taus", "-1"}), kUsageError);
}

TEST_F(AnalyseCommand, says_that_no_tau_fits_the_record) {
  EXPECT_EQ(run({file("offsets.csv"), "--taus", "1e9,0.1", "--json", file("j")}), kRuntimeError);
  EXPECT_EQ(errors_, "ftcs: " + file("offsets.csv") +
                         ": --taus 1e9,0.1: none fits the record of 6 values, one in 1 s\n");
  EXPECT_TRUE(output_.empty());
  EXPECT_FALSE(std::filesystem::exists(file("j")));
  EXPECT_EQ(run({file("offsets.csv"), "--taus", "1e9,1"}), kSuccess) << "one of them does";
}

TEST_F(AnalyseCommand, leaves_with_1_and_one_line_when_the_data_is_no_good) {
  std::ofstream(file("empty")) << "";
  std::ofstream(file("words")) << "1\n2\nthree\n";
  std::ofstream(file("binary"), std::ios::binary) << std::string(100, '\0');
  for (const char* name : {"empty", "words", "binary", "missing"}) {
    EXPECT_EQ(run({file(name)}), kRuntimeError) << name;
    EXPECT_TRUE(output_.empty());
    EXPECT_EQ(errors_.rfind("ftcs: " + file(name) + ":", 0), 0U) << errors_;
    EXPECT_EQ(std::count(errors_.begin(), errors_.end(), '\n'), 1) << errors_;
  }
}

TEST_F(AnalyseCommand, keeps_the_other_results_when_one_cannot_be_written) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  EXPECT_EQ(run({file("offsets.csv"), "-q", "--json", "/dev/full", "--csv", file("c")}),
            kRuntimeError);
  EXPECT_NE(errors_.find("No space left on device"), std::string::npos);
  EXPECT_FALSE(content(file("c")).empty());
}

TEST_F(AnalyseCommand, writes_json_to_the_standard_output) {
  EXPECT_EQ(run({file("offsets.csv"), "-q", "--json", "-"}), kSuccess);
  EXPECT_EQ(output_.rfind("{\n  \"file\"", 0), 0U);
}

}  // namespace
}  // namespace ftcs::app
