// A resolved study needs no other file, and nobody fits again what it holds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include "common/base/content_hash.h"
#include "learner/study/resolved_study.h"
#include "learner/study/study_file.h"
#include "learner/study/task_table.h"
#include "tests/study/equal_studies.h"
#include "tests/study/small_study.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using study_test::error_of;
using study_test::kSmallStudy;
using study_test::StudyText;
using testing::HasSubstr;
using testing::Not;

/// The small study, starting from a demonstration in demo.csv beside it.
class StandaloneStudyTest : public testing::Test {
 protected:
  StandaloneStudyTest()
      : file_(kSmallStudy +
              "policy.demonstration = {kind = \"csv\", files = [\"demo.csv\"], inputs = [\"t\"], "
              "outputs = [\"u\"]}\n") {
    std::ofstream demonstration(file_.folder() / "demo.csv");
    demonstration << "t,note,u\r\n";
    for (int i = 0; i < 50; ++i) demonstration << i / 19. << ",x," << (i * i) % 11 / 3. << "\r\n";
    demonstration.close();
    loaded_.emplace(load_study(file_.path(), {}));
    resolved_ = loaded_->resolved.to_toml("0.2.0");
  }

  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  static std::string error(const std::string& text) {
    return error_of(StudyText(text), [](const fs::path& path) { (void)load_study(path, {}); });
  }

  const StudyText file_;
  std::optional<LoadedStudy> loaded_;
  std::string resolved_;
};

TEST_F(StandaloneStudyTest, HoldsItsDemonstrationAndNamesNoFile) {
  fs::remove(file_.folder() / "demo.csv");
  const StudyText elsewhere(resolved_);
  const LoadedStudy again = load_study(elsewhere.path(), {});
  study_test::expect_equal(again.study, loaded_->study);
  EXPECT_EQ(again.log_likelihoods, loaded_->log_likelihoods);
  EXPECT_EQ(*again.demonstrations[0], *loaded_->demonstrations[0]);
  EXPECT_EQ(again.resolved.to_toml("0.2.0"), resolved_);
  EXPECT_THAT(resolved_, Not(HasSubstr(file_.folder().string())));
  EXPECT_THAT(resolved_, Not(HasSubstr("demo.csv")));
  EXPECT_THAT(resolved_, HasSubstr("t,u\n0,0\n"));  // not the column that nobody asked for
}

TEST_F(StandaloneStudyTest, NeitherThePlaceNorTheLineEndsOfAFileAreInIt) {
  const StudyText other(std::string(kSmallStudy) +
                        "policy.demonstration = {kind = \"csv\", files = [\"other.csv\"], inputs = "
                        "[\"t\"], outputs = [\"u\"]}\n");
  std::ofstream demonstration(other.folder() / "other.csv");
  demonstration << "u,t\n";
  for (int i = 0; i < 50; ++i) demonstration << (i * i) % 11 / 3. << ',' << i / 19. << '\n';
  demonstration.close();
  EXPECT_EQ(load_study(other.path(), {}).resolved.to_toml("0.2.0"), resolved_);
  // The study's own line ends neither.
  std::string windows;
  for (const char c : resolved_) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const StudyText carried(windows);
  EXPECT_EQ(load_study(carried.path(), {}).resolved.to_toml("0.2.0"), resolved_);
}

TEST_F(StandaloneStudyTest, HoldsSeveralDemonstrationsAsTheyWereAligned) {
  const StudyText study(std::string(kSmallStudy) +
                        "policy.demonstration = {kind = \"csv\", files = [\"demo.csv\", "
                        "\"slow.csv\"], inputs = [\"t\"], outputs = [\"u\"], align = "
                        "\"dynamic_time_warping\"}\n");
  fs::copy(file_.folder() / "demo.csv", study.folder() / "demo.csv");
  std::ofstream slow(study.folder() / "slow.csv");
  slow << "t,u\n";
  for (int i = 0; i < 50; ++i) slow << 7 + i / 9.5 << ',' << (i * i) % 11 / 3. << '\n';
  slow.close();
  const LoadedStudy loaded = load_study(study.path(), {});
  const Eigen::MatrixXd& data = *loaded.demonstrations[0];
  ASSERT_EQ(data.cols(), 100);
  EXPECT_LT((data.leftCols(50) - data.rightCols(50)).norm(), 1e-4) << "one movement";
  fs::remove(study.folder() / "slow.csv");
  const std::string resolved = loaded.resolved.to_toml("0.2.0");
  EXPECT_THAT(resolved, Not(HasSubstr("align")));
  const LoadedStudy again = load_study(StudyText(resolved).path(), {});
  study_test::expect_equal(again.study, loaded.study);
  EXPECT_EQ(*again.demonstrations[0], data);
}

TEST_F(StandaloneStudyTest, TheStartThatItHoldsIsTakenAndFittedAgainOnlyWhereThatIsAsked) {
  // Another number in the stored policy: nothing but the text can give it.
  const std::string policy = to_json(*loaded_->study.conditions[0].start);
  const PolicyPtr start = loaded_->study.conditions[0].start;
  const std::string changed = to_json(*start->with(start->theta() * 1.5));
  const StudyText file(replaced(resolved_, policy, changed));
  EXPECT_EQ(to_json(*load_study(file.path(), {}).study.conditions[0].start), changed);
  const LoadedStudy refitted =
      load_study(file.path(), {}, learnable_policies(), StoredStarts::kFittedAgain);
  EXPECT_EQ(to_json(*refitted.study.conditions[0].start), policy);
  // It belongs to the settings it was fitted by: others are fitted.
  const LoadedStudy other = load_study(file.path(), {"policy.fit.iterations=3"});
  EXPECT_NE(to_json(*other.study.conditions[0].start), changed);
  EXPECT_NE(to_json(*other.study.conditions[0].start), policy);
}

TEST_F(StandaloneStudyTest, HostileContentsAreRefusedWithTheirPlace) {
  const std::string content = to_hex(content_hash(
      resolved_.substr(resolved_.find("t,u\n"),
                       resolved_.find("'''", resolved_.find("t,u\n")) - resolved_.find("t,u\n"))));
  ASSERT_THAT(resolved_, HasSubstr("content = \"" + content + "\""));
  EXPECT_THAT(error(replaced(resolved_, "t,u\n0,0\n", "t,u\n0,1\n")),
              HasSubstr("demonstrations." + content + ": has another content, "));
  EXPECT_THAT(
      error(replaced(resolved_, "content = \"" + content, "content = \"" + std::string(32, '0'))),
      HasSubstr("is no entry of the study's [demonstrations]"));
  EXPECT_THAT(error(replaced(resolved_, "outputs = [\"u\"]", "outputs = [\"v\"]")),
              HasSubstr("demonstrations." + content + ":1: has no column \"v\""));
  const std::string bad = "t,u\n0,zero\n1,2\n";
  EXPECT_THAT(error(kSmallStudy + "policy.demonstration = {kind = \"csv\", content = \"" +
                    to_hex(content_hash(bad)) +
                    "\", inputs = [\"t\"], outputs = [\"u\"]}\n[demonstrations]\n" +
                    to_hex(content_hash(bad)) + " = \"\"\"\n" + bad + "\"\"\"\n"),
              HasSubstr(":2: column \"u\" is \"zero\""));
  EXPECT_THAT(error(std::string(kSmallStudy) + "[demonstrations]\nx = 3\n"),
              HasSubstr("demonstrations.x: must be the text of a demonstration"));
  EXPECT_THAT(error(std::string(kSmallStudy) + "[starts]\nx = 3\n"),
              HasSubstr("starts.x: must be a table"));
  EXPECT_THAT(error("demonstrations = 3\n" + std::string(kSmallStudy)),
              HasSubstr("demonstrations = 3: must be a table"));
  // A stored start must be such a policy as its settings describe.
  const PolicyPtr start = loaded_->study.conditions[0].start;
  EXPECT_THAT(error(replaced(resolved_, to_json(*start), to_json(*start->at_layer(2)))),
              HasSubstr("the study's stored start is another one: its explored layer differs"));
  EXPECT_THAT(error(replaced(resolved_, to_json(*start), "{}")), HasSubstr(".policy: "));
}

TEST_F(StandaloneStudyTest, ALaterFormIsNamedWithTheProgramThatWroteIt) {
  EXPECT_THAT(resolved_, HasSubstr("[written_by]\nformat = 3\nprogram = \"0.2.0\"\n"));
  EXPECT_EQ(error(replaced(resolved_, "format = 3\nprogram = \"0.2.0\"",
                           "format = 4\nnew = true\nprogram = \"4.5\"")),
            "FILE:3: written_by.format = 4: this program reads forms up to 3: take treeroll 4.5");
  EXPECT_THAT(error(replaced(resolved_, "format = 3", "format = \"x\"")),
              HasSubstr("written_by.format"));
}

/// A form that is not known may hold tables and settings that are not either.
TEST_F(StandaloneStudyTest, ALaterFormIsRefusedBeforeItsTablesAre) {
  const std::string later =
      replaced(resolved_, "format = 3\nprogram = \"0.2.0\"", "format = 4\nprogram = \"4.5\"") +
      "\n[cameras]\nnumber = 2\n";
  const std::string refusal =
      "FILE:3: written_by.format = 4: this program reads forms up to 3: take treeroll 4.5";
  EXPECT_EQ(error(later), refusal);
  EXPECT_EQ(error_of(StudyText(later), [](const fs::path& path) { (void)read_study_name(path); }),
            refusal);
  EXPECT_EQ(error("written_by = 3\n" + std::string(kSmallStudy)),
            "FILE:1: written_by = 3: must be a table");
}

TEST_F(StandaloneStudyTest, ANameIsReadOfAnyTomlThatAStudyMayBe) {
  const auto name_error = [](const std::string& text) {
    return error_of(StudyText(text), [](const fs::path& path) { (void)read_study_name(path); });
  };
  EXPECT_EQ(read_study_name(StudyText("[study]\nname = \"mine\"\n").path()), "mine");
  EXPECT_EQ(name_error("[study]\nname = 3\n"), "FILE:2: study.name: must be a string");
  EXPECT_EQ(name_error("study = 3\n"), "FILE:1: study.name: must be a string");
  EXPECT_EQ(name_error("[task]\n"), "FILE: study.name: must be a string");
  EXPECT_THAT(name_error("[study\n"), HasSubstr("FILE:1:"));
  // What costs a parser its stack.
  std::string deep = "[study]\nname = \"mine\"\na";
  for (int i = 0; i < 400'000; ++i) deep += ".a";
  EXPECT_THAT(name_error(deep + " = 1\n"), HasSubstr("FILE:3: is nested deeper than"));
}

/// As version 0.1.0 wrote it: the files by their absolute paths, the hash of their bytes, no store.
TEST_F(StandaloneStudyTest, AStudyOfTheFirstFormIsWrittenInThisOneAndNeedsItsFilesNoMore) {
  std::ifstream csv(file_.folder() / "demo.csv", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(csv), {}};
  const std::string of_files = to_hex(content_hash(to_hex(content_hash(bytes))));
  const std::size_t content = resolved_.find("content = \"");
  std::string first = resolved_;
  first.replace(content, std::string("content = \"").size() + 32 + 1,
                "content = \"" + of_files + "\"\nfiles = [\"" +
                    (file_.folder() / "demo.csv").string() + "\"]");
  first.erase(first.find("[demonstrations]"));
  first = replaced(first, "[written_by]\nformat = 3\nprogram = \"0.2.0\"\n", "");
  const StudyText old(first);
  const LoadedStudy loaded = load_study(old.path(), {});
  study_test::expect_equal(loaded.study, loaded_->study);
  EXPECT_EQ(loaded.lasting_id, loaded_->lasting_id);
  EXPECT_EQ(loaded.resolved.to_toml("0.2.0"), resolved_);
  fs::remove(file_.folder() / "demo.csv");
  const StudyText written(loaded.resolved.to_toml("0.2.0"));
  study_test::expect_equal(load_study(written.path(), {}).study, loaded.study);
}

/// Nor did that of form 1, which does not say its form.
TEST_F(StandaloneStudyTest, AStudyOfTheFirstFormIsNotRefined) {
  std::string first = replaced(resolved_, "[written_by]\nformat = 3\nprogram = \"0.2.0\"\n", "");
  first = replaced(first, "refine = \"regression\"\n", "");
  first = replaced(first, "stop_relative_error = 0.02\n", "");
  const StudyText text(first);
  EXPECT_THAT(load_resolved_study(text.path()).resolved.to_toml(""),
              HasSubstr("refine = \"none\""));
  EXPECT_THAT(load_study(text.path(), {}).resolved.to_toml(""),
              HasSubstr("refine = \"regression\""));
}

/// Programs that wrote form 2 refined no fit, and their studies do not say so.
TEST_F(StandaloneStudyTest, AStudyOfTheSecondFormKeepsTheFitThatItHad) {
  std::string second = replaced(resolved_, "format = 3", "format = 2");
  second = replaced(second, "refine = \"regression\"\n", "");
  second = replaced(second, "stop_relative_error = 0.02\n", "");
  EXPECT_THAT(load_study(StudyText(second).path(), {}).resolved.to_toml(""),
              HasSubstr("refine = \"none\""));
}

TEST_F(StandaloneStudyTest, WhatATaskHasResolvedIsPartOfTheStudy) {
  const TaskDescription description{
      .input_dim = 1, .output_dim = 1, .reward_max = 1, .time_limit_s = 7, .version = "5"};
  EXPECT_EQ(unresolved_condition(*loaded_), "tree");
  resolve_task(*loaded_, 0, R"({"plant": "rk4", "step_s": 0.005, "gravity": 9.81})", description);
  EXPECT_EQ(unresolved_condition(*loaded_), "");
  const std::string& content = loaded_->study.conditions[0].task_content;
  EXPECT_THAT(content, HasSubstr(R"("settings":{"gravity":9.81,"plant":"rk4","step_s":0.005})"));
  EXPECT_THAT(content, HasSubstr(R"("version":"5")"));
  const StudyText file(loaded_->resolved.to_toml(""));
  EXPECT_EQ(load_study(file.path(), {}).study.conditions[0].task_content, content);
  // What the command line changes is asked of the task anew.
  EXPECT_THAT(load_study(file.path(), {"task.gravity=1.6"}).study.conditions[0].task_content,
              Not(HasSubstr("described")));
  EXPECT_THAT(
      error(replaced(loaded_->resolved.to_toml(""), "time_limit_s = 7.0", "time_limit_s = -7.0")),
      HasSubstr("task.described: description.time_limit_s"));
}

TEST_F(StandaloneStudyTest, WhatATaskCallsItsSignalsIsKeptBesideWhatWorkersAreSent) {
  TaskDescription description{
      .input_dim = 1, .output_dim = 1, .reward_max = 1, .time_limit_s = 7, .version = "5"};
  resolve_task(*loaded_, 0, "{}", description);
  const std::string content = loaded_->study.conditions[0].task_content;
  EXPECT_TRUE(loaded_->study.conditions[0].signals.empty());
  const std::vector<std::string> of_demonstration = loaded_->columns[0];
  EXPECT_EQ(load_study(StudyText(loaded_->resolved.to_toml("")).path(), {}).columns[0],
            of_demonstration);

  description.signals = {{"time_s"}, {"force_n"}};
  resolve_task(*loaded_, 0, "{}", description);
  EXPECT_EQ(loaded_->study.conditions[0].task_content, content);
  const StudyText file(loaded_->resolved.to_toml(""));
  const LoadedStudy again = load_study(file.path(), {});
  EXPECT_EQ(again.study.conditions[0].task_content, content);
  EXPECT_EQ(again.study.conditions[0].signals, description.signals);
  EXPECT_EQ(again.columns[0], (std::vector<std::string>{"time_s", "force_n"}));
  EXPECT_EQ(again.resolved.to_toml(""), loaded_->resolved.to_toml(""));

  EXPECT_NO_THROW(check_task(again, 0, {1, 1}));
  EXPECT_NO_THROW(check_task(again, 0, {1, 1, description.signals}));
  try {
    check_task(again, 0, {1, 1, {{"time_s"}, {"force_kn"}}});
    FAIL() << "another task";
  } catch (const StudyError& error) {
    EXPECT_THAT(error.what(), HasSubstr("task.described: in the study the task's outputs are "
                                        "force_n, here they are force_kn"));
  }
}

TEST_F(StandaloneStudyTest, ALargeDemonstrationIsHeldToo) {
  std::ofstream demonstration(file_.folder() / "demo.csv");
  demonstration << "t,u\n";
  for (int i = 0; i < 90'000; ++i) demonstration << i / 19e3 << ',' << (i % 1001) / 7. << '\n';
  demonstration.close();
  const LoadedStudy large =
      load_study(file_.path(), {"policy.fit.iterations=1", "policy.fit.refine=none"});
  const StudyText resolved(large.resolved.to_toml(""));
  EXPECT_GT(fs::file_size(resolved.path()), 1U << 20U);
  const LoadedStudy again = load_study(resolved.path(), {});
  study_test::expect_equal(again.study, large.study);
  EXPECT_EQ(*again.demonstrations[0], *large.demonstrations[0]);
}

/// It ran, if slowly: it is read, resumed and replayed.
TEST(BegunStudyTest, IsReadWhateverItsStartsCost) {
  const std::string large = study_test::with(
      "model = \"top_down_tree\"",
      "kind = \"spline\"\nstart = \"constant\"\nrange = [0, 2]\ncoefficients = [128, 253]\n"
      "values = [0, 0, 0, 0]");
  const std::string noise = "noise_variance = [0.01, 0.3, 0.02]";
  std::string text = large;
  text.replace(text.find(noise), noise.size(), "noise_variance = [0.01, 0.01, 0.01, 0.01]");
  const StudyText study(text);
  EXPECT_THAT(error_of(study, [](const fs::path& path) { (void)load_study(path, {}); }),
              HasSubstr("exploration.reuse"));
  EXPECT_EQ(load_resolved_study(study.path()).study.conditions.at(0).start->num_layers(), 2);
}

}  // namespace
}  // namespace treeroll
