#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "learner/report/learnt_policies.h"
#include "learner/report/noise_levels.h"
#include "learner/report/report.h"
#include "tests/files/scratch_folder.h"
#include "tests/journal/learnt_study.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;
using study_test::deep_study;
using study_test::learn_into;
using study_test::tree_study;
using testing::HasSubstr;
using testing::Not;

class ReportFiguresTest : public testing::Test {
 protected:
  /// A program that answers as a worker executable would.
  fs::path worker(const std::string& evaluation, const std::string& facts = "") const {
    const fs::path program = folder_ / "worker";
    std::ofstream(program) << "#!/bin/sh\ncat > /dev/null\nif [ $1 = --describe-task ]; then\n"
                              "echo '{\"description\": {\"input_dim\": 1, \"output_dim\": 1, "
                              "\"reward_min\": 0, \"reward_max\": 1, \"time_limit_s\": 1, "
                              "\"deterministic\": false"
                           << facts << "}, \"settings\": {}}'\nelse\necho moved >> "
                           << (folder_ / "moved").string() << "\necho '" << evaluation << "'\nfi\n";
    fs::permissions(program, fs::perms::owner_all);
    return program;
  }
  std::string report(const std::string& output, const fs::path& worker_program) const {
    write_report({.directories = {folder_ / "study"},
                  .claims_file = "",
                  .output = folder_ / output,
                  .compare = {},
                  .worker_program = {.path = worker_program, .evaluator = {}}});
    return content(fs::path(output) / "report.md");
  }
  std::string content(const fs::path& path) const {
    std::ifstream file(folder_ / path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  Study study() const { return load_study(folder_ / "study/study.toml", {}).study; }
  StudyResults results() const { return read_study_results(folder_ / "study"); }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
};

constexpr const char* kTraced =
    R"({"evaluation": {"reward": 0.5, "status": "ok"},
    "trace": {"columns": ["time_s", "x_m", "goal_x_m"], "numbers": [0, 1, 2, 1, 3, 4],
    "policy_inputs": ["time_s"], "policy_outputs": ["x_m"],
    "poses": [[[0, 0, 1, 1]], [[0, 0, null, 1]]]}})";

/// A task that names no terms has the report it had before.
TEST_F(ReportFiguresTest, TermsOfARewardHaveATableWhereTheTaskNamesThem) {
  learn_into(folder_ / "study", tree_study(""));
  const std::string plain = report("plain", worker(kTraced));
  EXPECT_THAT(plain, Not(HasSubstr("is made of")));
  EXPECT_THAT(content("plain/report.json"), Not(HasSubstr("\"terms\"")));
  std::string answer = kTraced;
  answer.insert(answer.find("\"status\""), R"("terms": {"miss|m": 0.125, "lost": null}, )");
  const std::string told = report("told", worker(answer));
  EXPECT_THAT(told, HasSubstr("What the reward of a roll-out is made of"));
  EXPECT_THAT(told, HasSubstr("| tree | lost | nan | nan |"));
  EXPECT_THAT(told, HasSubstr("| 0.125 | 0.125 |"));
  EXPECT_THAT(content("told/report.json"), HasSubstr("\"terms\""));
  EXPECT_THAT(content("told/report.html"), HasSubstr("miss|m"));
}

TEST_F(ReportFiguresTest, NoiseIsThatOfTheRunsToTheBit) {
  const auto learnt = learn_into(folder_ / "study", tree_study(""));
  EXPECT_GT(learnt.num_switches, 0);
  const NoiseLevels found = noise_levels(study(), results(), 1'000'000);
  EXPECT_EQ(found, learnt.noise);
  EXPECT_EQ(found.at("tree").size(), 2);
  EXPECT_EQ(found.at("tree")[0].size(), 12);
}

TEST_F(ReportFiguresTest, WhereResultsWereAppliedAsTheyArrivedTheJournalHasTheirOrder) {
  const auto learnt =
      learn_into(folder_ / "study", tree_study("order = \"arrival\"\nin_flight = 3"));
  EXPECT_EQ(noise_levels(study(), results(), 1'000'000), learnt.noise);
  fs::remove(folder_ / "study/journal.lcmlog");
  EXPECT_THROW(noise_levels(study(), results(), 1'000'000), std::runtime_error);
  EXPECT_THAT(report("out", ""), HasSubstr("growth of noise is not drawn"));
}

TEST_F(ReportFiguresTest, EverySwitchIsTheRunsOwnInWhateverOrderResultsArrived) {
  int num_second = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(testing::Message() << "order drawn from seed " << seed);
    const auto learnt = learn_into(
        folder_ / "study", deep_study("order = \"arrival\"\nin_flight = 20"), {.seed = seed});
    const StudyResults read = results();
    ASSERT_EQ(read.runs.size(), learnt.runs.size());
    for (std::size_t run = 0; run < read.runs.size(); ++run) {
      EXPECT_EQ(read.runs[run].switches, learnt.runs[run].switches);
      if (read.runs[run].switches.size() == 2) ++num_second;
    }
    EXPECT_EQ(noise_levels(study(), read, 1'000'000), learnt.noise);
    fs::remove_all(folder_ / "study");
  }
  EXPECT_GT(num_second, 8);
}

TEST_F(ReportFiguresTest, WhatCameAfterTheTimeOfAStudyWasUpChangesNoNoise) {
  for (const char* order : {"arrival", "sequence"}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(testing::Message() << order << ", order drawn from seed " << seed);
      const auto learnt = learn_into(
          folder_ / "study",
          deep_study(std::string("stop_after_s = 60\nin_flight = 20\norder = \"") + order + '"'),
          {.seed = seed, .results_before_stop = 70});
      const NoiseLevels found = noise_levels(study(), results(), 1'000'000);
      for (const auto& [condition, by_repetition] : learnt.noise) {
        for (std::size_t repetition = 0; repetition < by_repetition.size(); ++repetition) {
          const std::vector<double>& noise = found.at(condition).at(repetition);
          ASSERT_LT(noise.size(), 91);  // twenty were under way
          ASSERT_EQ(by_repetition[repetition].size(), noise.size());
          for (std::size_t i = 0; i < noise.size(); ++i) {
            const double known = by_repetition[repetition][i];
            EXPECT_TRUE(std::isnan(known) || noise[i] == known) << condition << ", " << i;
          }
        }
      }
      fs::remove(folder_ / "study/journal.lcmlog");
      EXPECT_THROW(noise_levels(study(), results(), 1'000'000), std::runtime_error);
      fs::remove_all(folder_ / "study");
    }
  }
}

TEST_F(ReportFiguresTest, SoManyRepetitionsAreDrawnAgainAsTheBoundAllows) {
  const auto learnt = learn_into(folder_ / "study", tree_study(""));
  // One repetition of both conditions has 24 roll-outs.
  const NoiseLevels one = noise_levels(study(), results(), 47);
  EXPECT_EQ(one.at("flat"), std::vector<std::vector<double>>{learnt.noise.at("flat")[0]});
  EXPECT_TRUE(noise_levels(study(), results(), 23).empty());
}

TEST_F(ReportFiguresTest, ResultsThatDoNotFollowFromTheStudyHaveNoNoise) {
  learn_into(folder_ / "study", tree_study(""));
  StudyResults forged = results();
  for (RunRecord& run : forged.runs) {
    for (RolloutRecord& rollout : run.rollouts) rollout.reward = 1 - rollout.reward;
  }
  EXPECT_THROW(noise_levels(study(), forged, 1'000'000), std::runtime_error);
  forged = results();
  forged.runs.pop_back();
  EXPECT_THROW(noise_levels(study(), forged, 1'000'000), std::runtime_error);
  forged = results();
  forged.runs[0].rollouts.resize(20, forged.runs[0].rollouts.back());  // past the budget
  EXPECT_THROW(noise_levels(study(), forged, 1'000'000), std::runtime_error);
}

TEST_F(ReportFiguresTest, WithoutAWorkerExecutableTheReportStandsAndSaysSo) {
  learn_into(folder_ / "study", tree_study(""));
  testing::internal::CaptureStderr();
  const std::string text = report("out", folder_ / "nobody");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("nobody: no worker executable"));
  EXPECT_THAT(text, HasSubstr("there was no worker executable to ask"));
  for (const char* id : {"noise\\_growth", "layers", "policies"}) {
    EXPECT_THAT(text, HasSubstr("mine/"));
    const std::string file = id == std::string("noise\\_growth") ? "noise_growth" : id;
    EXPECT_FALSE(content("out/figures/mine/" + file + ".svg").empty()) << id;
  }
  EXPECT_THAT(text, Not(HasSubstr("motion.svg")));
}

TEST_F(ReportFiguresTest, WhatTheWorkerRecordsIsDrawnAndTheSameBytesEachTime) {
  learn_into(folder_ / "study", tree_study(""));
  const std::string text = report("one", worker(kTraced));
  EXPECT_THAT(text, HasSubstr("(figures/mine/motion.svg)"));
  EXPECT_THAT(text, HasSubstr("shown with seed 0"));
  EXPECT_THAT(content("one/figures/mine/policies.gp"), HasSubstr("set ylabel 'x (m)'"));
  EXPECT_THAT(content("one/figures/mine/policies.dat"), HasSubstr("goal\n0 2\n1 4\n"));
  EXPECT_THAT(content("one/figures/mine/layers.gp"), HasSubstr("set ylabel 'x (m)'"));
  EXPECT_EQ(report("two", worker(kTraced)), text);
  EXPECT_EQ(content("two/report.html"), content("one/report.html"));
  EXPECT_EQ(content("two/figures/mine/motion.png"), content("one/figures/mine/motion.png"));
}

TEST_F(ReportFiguresTest, RunsThatReachedTheirTargetStayInTheReport) {
  const auto learnt = learn_into(folder_ / "study", tree_study(""));
  double best = 0;
  for (const RunRecord& run : learnt.runs) best = std::max(best, run.best_reward);
  EXPECT_THAT(report("full", ""), Not(HasSubstr("were done before")));
  fs::remove_all(folder_ / "study");
  std::string text = tree_study("");
  text.insert(text.find("first_update"), "stop_at_reward = " + nlohmann::json(best).dump() + "\n");
  learn_into(folder_ / "study", text);
  int num_short = 0;
  for (const RunRecord& run : results().runs) num_short += run.rollouts.size() < 12 ? 1 : 0;
  ASSERT_EQ(num_short, 1) << "one has the best reward of all";
  const std::string told = report("out", "");
  EXPECT_THAT(told, testing::ContainsRegex("(tree|flat) 1 of 2\\. In curves"));
  EXPECT_THAT(told, HasSubstr("go on to it with the reward that they ended with"));
  const std::string curves = content("out/figures/mine/learning_curves.dat");
  EXPECT_THAT(curves, Not(testing::ContainsRegex("\n12 [^ ]+ NaN"))) << "both runs are in it";
}

TEST_F(ReportFiguresTest, WhatMayBeARobotDoesNotMoveForAPicture) {
  learn_into(folder_ / "study", tree_study(""));
  testing::internal::CaptureStderr();
  const std::string text = report("robot", worker(kTraced, R"(, "repeatable": false)"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_FALSE(fs::exists(folder_ / "moved"));
  EXPECT_THAT(text, HasSubstr("repeatable = false: they may be robots"));
  EXPECT_THAT(text, HasSubstr("So it is with: tree, flat."));
  EXPECT_THAT(text, Not(HasSubstr("could not make the roll-outs")));
  EXPECT_THAT(text, HasSubstr("(figures/mine/policies.svg)"));
  EXPECT_THAT(text, Not(HasSubstr("motion.svg")));
  (void)report("other", worker(kTraced));
  EXPECT_TRUE(fs::exists(folder_ / "moved"));
}

TEST_F(ReportFiguresTest, EveryRepetitionsBestIsASolution) {
  learn_into(folder_ / "study", tree_study(""));
  const LoadedStudy loaded = load_study(folder_ / "study/study.toml", {});
  const auto policies = learnt_policies(loaded, results());
  ASSERT_EQ(policies.size(), 2U);
  EXPECT_EQ(policies[0].solutions.size(), 2U);
  EXPECT_THAT(policies[0].solutions, testing::Contains(policies[0].best));
  EXPECT_THAT(report("out", worker(kTraced)), HasSubstr("(figures/mine/solutions.svg)"));
  EXPECT_THAT(content("out/figures/mine/solutions.gp"), HasSubstr("set title 'tree (2)'"));
}

TEST_F(ReportFiguresTest, AxesHaveTheNamesOfTheDemonstrationsColumns) {
  std::ofstream(folder_ / "demo.csv") << "t_ms,left_deg\n0,1\n1,2\n2,5\n3,1\n4,0\n5,3\n";
  std::string text = tree_study("");
  const std::size_t begin = text.find("start = \"components\"");
  text.replace(begin, text.find("[exploration]") - begin,
               "components = [1, 2]\nlayout = \"means\"\n[policy.demonstration]\nkind = \"csv\"\n"
               "files = [\"" +
                   (folder_ / "demo.csv").string() +
                   "\"]\ninputs = [\"t_ms\"]\noutputs = [\"left_deg\"]\n");
  learn_into(folder_ / "study", text);
  (void)report("out", worker(kTraced));
  for (const char* name : {"layers", "policies", "solutions"}) {
    EXPECT_THAT(content("out/figures/mine/" + std::string(name) + ".gp"),
                HasSubstr("set xlabel 't (ms)'; set ylabel 'left (°)'"))
        << name;
  }
}

TEST_F(ReportFiguresTest, AWorkerThatAnswersAmissCostsItsPicturesNotTheReport) {
  learn_into(folder_ / "study", tree_study(""));
  const struct {
    std::string answer;
    const char* said;
  } cases[] = {
      {R"({"error": {"key": 5}})", "said nothing that can be read"},
      {R"({"error": {"key": "task.x", "value": [], "rule": {}}})", "said nothing that can be read"},
      {R"({"error": "no"})", "said nothing that can be read"},
      {"[1]", "said nothing that can be read"},
      {std::string(5000, '['), "said nothing that can be read"},
      {R"({"evaluation": 1})", "said nothing that can be read"},
      {R"({"error": {"key": "task.x", "value": "3", "rule": "must be less"}})",
       "task.x = 3: must be less"},
      {R"({"error": {}})", "request: is refused"}};
  for (const auto& [answer, said] : cases) {
    const LoadedStudy loaded = load_study(folder_ / "study/study.toml", {});
    std::vector<LearntPolicy> policies = learnt_policies(loaded, results());
    testing::internal::CaptureStderr();
    const auto remarks = make_rollouts(loaded, {.path = worker(answer), .evaluator = {}}, policies);
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr(said)) << answer;
    EXPECT_THAT(remarks, testing::Contains(HasSubstr("could not make the roll-outs"))) << answer;
  }
}

TEST_F(ReportFiguresTest, AWorkerOfAnEarlierVersionNamesNoVariablesAndHasNoPoses) {
  learn_into(folder_ / "study", tree_study(""));
  const std::string text = report("out", worker(R"({"evaluation": {"reward": 0.5, "status": "ok"},
      "trace": {"columns": ["time_s"], "numbers": [0]}})"));
  EXPECT_THAT(text, Not(HasSubstr("motion.svg")));
  EXPECT_THAT(content("out/figures/mine/policies.gp"), HasSubstr("set xlabel 'input'"));
}

TEST_F(ReportFiguresTest, AWorkerThatSaysNonsenseMakesNoRollouts) {
  learn_into(folder_ / "study", tree_study(""));
  const LoadedStudy loaded = load_study(folder_ / "study/study.toml", {});
  const std::string begin = R"({"evaluation": {"reward": 0.5, "status": "ok"},
      "trace": {"columns": ["time_s"], "numbers": [0, 1])";
  for (const std::string& said : std::vector<std::string>{
           "", "[]", begin, R"({"error": {"key": "policy", "value": "", "rule": "no"}})",
           begin + R"(, "poses": [[[0, 0]]]}})",                // a row without a pose
           begin + R"(, "poses": [[[0]], [[0]]]}})",            // a point without a height
           begin + R"(, "poses": [[["a", 0]], [[0, 0]]]}})",    // a word
           begin + R"(, "policy_inputs": ["angle_rad"]}})"}) {  // no column
    std::vector<LearntPolicy> policies = learnt_policies(loaded, results());
    testing::internal::CaptureStderr();
    const std::vector<std::string> remarks =
        make_rollouts(loaded, {.path = worker(said), .evaluator = {}}, policies);
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("cannot be shown")) << said;
    EXPECT_THAT(remarks, testing::Contains(HasSubstr("could not make the roll-outs: tree, flat.")));
    EXPECT_FALSE(policies[0].start_rollout) << said;
    EXPECT_FALSE(policies[1].best_rollout) << said;
  }
}

TEST_F(ReportFiguresTest, WhatIsAskedForMustBeThere) {
  const auto error_of = [&](const ReportOptions& options) -> std::string {
    try {
      write_report(options);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "written";
  };
  EXPECT_THAT(error_of({.directories = {folder_ / "nowhere"}, .output = folder_ / "out"}),
              HasSubstr("must be the state directory of a study"));
  learn_into(folder_ / "study", tree_study(""));
  EXPECT_THAT(error_of({.directories = {folder_ / "study"},
                        .output = folder_ / "out",
                        .worker_program = {.path = folder_ / "nobody", .evaluator = {}},
                        .needs_worker_program = true}),
              HasSubstr("--worker-program"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace treeroll::report
