#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/base/config_error.h"
#include "learner/report/report.h"
#include "learner/results/csv.h"
#include "tests/files/scratch_folder.h"
#include "tests/results/records.h"
#include "tests/study/small_study.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;
using report_test::run_with;
using testing::HasSubstr;
using testing::Not;

class ReportProgramTest : public testing::Test {
 protected:
  /// A study of two conditions, three repetitions each, "tree" ahead by `lead`.
  fs::path study(const std::string& directory, const std::string& name, double lead) const {
    std::vector<RunRecord> runs;
    for (int i = 0; i < 6; ++i) {
      const double reward = .3 + .01 * (i % 3) + (i < 3 ? lead : 0);
      runs.push_back(run_with(i < 3 ? "tree" : "flat", i % 3, i, std::vector<double>(8, reward)));
    }
    fs::create_directories(folder_ / directory);
    std::ofstream(folder_ / directory / "study.toml") << "[study]\nname = \"" << name << "\"\n";
    write_runs_csv(folder_ / directory / "runs.csv", runs);
    write_rollouts_csv(folder_ / directory / "rollouts.csv", runs);
    return folder_ / directory;
  }
  std::string content(const fs::path& path) const {
    std::ifstream file(folder_ / path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(std::vector<fs::path> directories, const std::string& output,
             std::vector<std::string> compare = {}) const {
    write_report({.directories = std::move(directories),
                  .claims_file = "",
                  .output = folder_ / output,
                  .compare = std::move(compare)});
  }
  std::string compare_error(std::vector<fs::path> directories, const char* first) const {
    try {
      write(std::move(directories), "out", {first, "flat"});
    } catch (const ConfigError& error) {
      return error.rule();
    }
    return "compared";
  }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
};

TEST_F(ReportProgramTest, TheSameResultsGiveTheSameBytesWhereverTheyLie) {
  write({study("a", "mine", .2)}, "one");
  write({study("deep/down/b", "mine", .2)}, "two");
  for (const char* name : {"report.html", "report.md", "report.json"}) {
    const std::string first = content(fs::path("one") / name);
    EXPECT_FALSE(first.empty()) << name;
    EXPECT_EQ(first, content(fs::path("two") / name)) << name;
  }
}

TEST_F(ReportProgramTest, FiguresLieBesideTheirNumbersAndScripts) {
  write({study("a", "mine", .2)}, "one");
  write({study("b", "mine", .2)}, "two");
  for (const char* name : {"learning_curves", "p_values"}) {
    for (const char* end : {".dat", ".gp", ".svg", ".png", ".pdf"}) {
      const fs::path file = fs::path("figures/mine") / (std::string(name) + end);
      EXPECT_FALSE(content("one" / file).empty()) << file;
      EXPECT_EQ(content("one" / file), content("two" / file)) << file;
    }
  }
  const std::string pdf = content("one/figures/mine/p_values.pdf");
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_THAT(pdf, Not(HasSubstr("CreationDate")));
  // 11811 dots a metre: 300 an inch.
  const std::string png = content("one/figures/mine/p_values.png");
  EXPECT_EQ(png.substr(37, 13), std::string("pHYs\0\0\x2e\x23\0\0\x2e\x23\x01", 13));
  EXPECT_THAT(content("one/report.md"), HasSubstr("(figures/mine/p_values.svg)"));
  EXPECT_THAT(content("one/report.html"),
              HasSubstr("<img alt=\"Learning curves of mine\" src=\"data:"));
}

TEST_F(ReportProgramTest, WithoutGnuplotThePackageIsNamed) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder_.c_str(), 1);
  try {
    write({study("a", "mine", .2)}, "out");
    ADD_FAILURE() << "drawn without gnuplot";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("apt-get install gnuplot-nox"));
  }
  ::setenv("PATH", path.c_str(), 1);
}

TEST_F(ReportProgramTest, TwoStudiesOfOneNameAreToldApartAndCompared) {
  write({study("a", "mine", .2), study("b", "mine", .4)}, "out");
  EXPECT_THAT(content("out/report.md"), HasSubstr("| mine:tree | mine (2):tree | 3, 3 |"));
}

TEST_F(ReportProgramTest, AFitIsJudgedOfWhicheverStudyItsConditionIs) {
  const fs::path mine = study("mine", "mine", .2);  // cannot be fitted again
  const fs::path fits = study("fits", "small", .2);
  std::ofstream(fits / "study.toml") << study_test::kSmallStudy;
  std::ofstream(folder_ / "claims.toml") << R"([[claims]]
text = "a fit of another study"
section = "1"
study = "mine"
kind = "within"
conditions = ["small:tree"]
measure = "log_likelihood"
low = -1000.0
high = 1000.0
[[claims]]
text = "a reward against a fit"
section = "2"
study = "mine"
kind = "greater"
margin = -1000.0
conditions = ["tree", "small:tree"]
rollout = 8
against = {measure = "log_likelihood"}
)";
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  write_report({.directories = {mine, fits},
                .claims_file = folder_ / "claims.toml",
                .output = folder_ / "out",
                .compare = {}});
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("2 claims: 2 hold"));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), Not(HasSubstr("are not judged")));
}

TEST_F(ReportProgramTest, ConditionsAreChosenByName) {
  const fs::path a = study("a", "mine", .2);
  const fs::path b = study("b", "other", .2);
  EXPECT_EQ(compare_error({a}, "tree"), "compared");
  EXPECT_THAT(content("out/report.md"), HasSubstr("| mine:tree | mine:flat | 3, 3 |"));
  EXPECT_EQ(compare_error({a}, "none"), "no study given has this condition");
  EXPECT_EQ(compare_error({a, b}, "tree"),
            "several studies have this condition: write STUDY:CONDITION");
  write({a, b}, "out", {"mine:tree", "other:flat"});
  EXPECT_THAT(content("out/report.md"), HasSubstr("| mine:tree | other:flat | 3, 3 |"));
}

}  // namespace
}  // namespace treeroll::report
