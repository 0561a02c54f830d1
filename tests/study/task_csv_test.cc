#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "learner/study/study_file.h"
#include "tests/study/small_study.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using study_test::error_of;
using study_test::StudyText;
using study_test::write;
using testing::HasSubstr;

/// The small study with these settings of a goal below those of its task.
std::string with_goal(const std::string& goal) {
  return std::string(study_test::kSmallStudy) + "\n[task.goal]\n" + goal + "\n";
}

TEST(TaskCsvTest, TheNumbersOfAFileBesideTheStudyTakeItsPlace) {
  const StudyText study(with_goal("columns = [\"t\", \"x\"]\ncsv_file = \"goal.csv\""));
  write(study.folder() / "goal.csv", "x,other,t\n0.1,a,0\n-1e-3,b,2.5\n");
  const LoadedStudy loaded = load_study(study.path(), {});
  EXPECT_THAT(loaded.study.conditions[0].task_content,
              HasSubstr(R"("goal":{"columns":["t","x"],"rows":[[0.0,0.1],[2.5,-0.001]]})"));
  // The resolved study stands alone.
  fs::remove(study.folder() / "goal.csv");
  const StudyText resolved(loaded.resolved.to_toml("test"));
  const LoadedStudy again = load_study(resolved.path(), {});
  EXPECT_EQ(again.study.conditions[0].task_content, loaded.study.conditions[0].task_content);
  EXPECT_EQ(again.resolved.to_toml("test"), loaded.resolved.to_toml("test"));
}

TEST(TaskCsvTest, RefusalsNameTheLineOfTheStudyTheKeyAndTheLineOfTheFile) {
  const auto error = [](const std::string& goal, const std::string& csv) {
    const StudyText study(with_goal(goal));
    if (!csv.empty()) write(study.folder() / "goal.csv", csv);
    return error_of(study, [](const fs::path& file) { load_study(file, {}); });
  };
  const std::string both = "columns = [\"t\", \"x\"]\ncsv_file = \"goal.csv\"";
  EXPECT_THAT(error(both, ""), HasSubstr("task.goal.csv_file = \"goal.csv\": "));
  EXPECT_THAT(error(both, ""), HasSubstr("is no file"));
  EXPECT_THAT(error(both, "t,x\n0,1\n1,much\n"), HasSubstr("goal.csv:3: "));
  EXPECT_THAT(error(both, "t,y\n0,1\n"), HasSubstr("has no column \"x\""));
  EXPECT_THAT(error(both, "t,x\n"), HasSubstr("holds no numbers"));
  EXPECT_THAT(error(both + "\nrows = [[0, 1]]", "t,x\n0,1\n"),
              HasSubstr("must not stand beside rows"));
  EXPECT_THAT(error("csv_file = \"goal.csv\"", "t,x\n0,1\n"),
              HasSubstr("task.goal.columns: is required beside csv_file"));
  EXPECT_THAT(error("columns = [1]\ncsv_file = \"goal.csv\"", "t,x\n0,1\n"),
              HasSubstr("task.goal.columns = [1]: must be a list of 1 to 33 names"));
  EXPECT_THAT(error("csv_file = 3", ""), HasSubstr("task.goal.csv_file = 3: must be a string"));
}

TEST(TaskCsvTest, TheCommandLineNamesAFileOfTheCurrentFolder) {
  const StudyText study(with_goal("columns = [\"t\", \"x\"]\ncsv_file = \"goal.csv\""));
  const fs::path file = study.folder() / "other.csv";
  write(file, "t,x\n0,7\n");
  const std::string named = fs::relative(file, fs::current_path()).string();
  const LoadedStudy loaded = load_study(study.path(), {"task.goal.csv_file=" + named});
  EXPECT_THAT(loaded.study.conditions[0].task_content, HasSubstr("[[0.0,7.0]]"));
}

}  // namespace
}  // namespace treeroll
