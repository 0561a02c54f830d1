// What someone new does first: asks for the keys, begins a study, looks at what it would do.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(HelpKeysTest, ThePageIsWhatTheProgramsPrint) {
  const Service service;
  const Said said = service.run("treeroll-learner", {"--help-keys"});
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_EQ(said.output, read_file(TREEROLL_SOURCE_DIR "/deploy/doc/keys.md"))
      << "write it anew: build/dev/bin/treeroll-learner --help-keys > deploy/doc/keys.md";
}

TEST(HelpKeysTest, APatternChoosesKeysOfTheStudyAndOfTasks) {
  const Service service;
  const Said said = service.run("treeroll-learner", {"--help-keys", "kmeans_seed"});
  EXPECT_THAT(said.output, AllOf(HasSubstr("`policy.fit.kmeans_seed`: integer, 0 to 1000000000"),
                                 Not(HasSubstr("study.rollouts"))));
  EXPECT_THAT(
      service.run("treeroll-learner", {"--help-keys", "GRAVITY"}).output,
      AllOf(HasSubstr("## [task] name = \"swing_up\""),
            HasSubstr("`task.parameters.gravity`: number in m/s^2"), Not(HasSubstr("[policy]"))));
}

/// A path in the folder of the test.
std::string in(const Service& service, const std::string& name) {
  return (service.directory() / name).string();
}

/// Writes a new study of a task.
fs::path new_study(const Service& service, const std::string& task) {
  const std::string file = in(service, task + ".toml");
  const Said said = service.run("treeroll-learner", {"--new", file, "--task", task});
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("next: treeroll-learner " + file + " --check"));
  return file;
}

/// The state directory of a learner that has ended: the only one there.
std::string state_of(const Service& service) {
  for (const auto& entry : fs::directory_iterator(service.directory())) {
    if (fs::exists(entry.path() / "journal.lcmlog")) return entry.path().string();
  }
  return "";
}

TEST(NewStudyTest, OfTheSwingUpLearnsAsItIsWritten) {
  const Service service;
  const auto learnt = service.learn(new_study(service, "swing_up"),
                                    {"--local-workers", "2", "--set", "study.repetitions=2"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const json& condition = learnt.summary["conditions"][0];
  EXPECT_GT(condition["mean_best_reward"].get<double>(), .9) << condition;
}

TEST(NewStudyTest, OfEveryTaskBecomesBetterThanItsStart) {
  const Service service;
  for (const std::string task : {"hold", "spiral", "synthetic", "trajectory"}) {
    const auto learnt = service.learn(
        new_study(service, task),
        {"--local-workers", "2", "--set", "study.repetitions=2", "--set", "study.rollouts=150"});
    ASSERT_EQ(learnt.status, 0) << task << learnt.log;
    const json& condition = learnt.summary["conditions"][0];
    EXPECT_GT(condition["mean_best_reward"].get<double>(),
              1.02 * condition["mean_start_reward"].get<double>())
        << task << condition;
  }
}

TEST(NewStudyTest, LeavesWhatIsThereAndSaysWhatIsWrong) {
  const Service service;
  write_file(in(service, "mine.toml"), "mine");
  const auto said = [&](const std::string& file, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--new", in(service, file), "--task"});
    const Said answer = service.run("treeroll-learner", arguments);
    EXPECT_EQ(answer.status, 2) << answer.errors;
    return answer.errors;
  };
  EXPECT_THAT(said("mine.toml", {"swing_up"}),
              HasSubstr("mine.toml: exists, and is left as it is"));
  EXPECT_EQ(read_file(in(service, "mine.toml")), "mine");
  EXPECT_THAT(said("other.toml", {"swing_down"}),
              HasSubstr("task.name = \"swing_down\": must be a task this worker knows: hold"));
  EXPECT_THAT(said("other.toml", {"swing_up", "--set", "task.alpha=-1"}),
              HasSubstr("task.alpha = -1: must be a finite number above 0"));
  EXPECT_THAT(said("other.toml", {"swing_up", "--set", "study.rollouts=5"}),
              HasSubstr("must be a setting of the task"));
  EXPECT_FALSE(fs::exists(in(service, "other.toml")));
}

TEST(NewStudyTest, TablesAndProgramsOfOnesOwnGoIntoTheFileAsTheNextStepNeedsThem) {
  const Service service;
  const std::string program = (service.directory() / "it's mine").string();
  fs::copy_file(executable("treeroll-worker"), program);
  const std::string file = in(service, "mine.toml");
  const Said said =
      service.run("treeroll-learner", {"--new", file, "--task", "swing_up", "--worker-program",
                                       program, "--set", "task.parameters={gravity=9.0}"});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("it'\\''s mine' --check"));
  EXPECT_THAT(read_file(file),
              AllOf(HasSubstr("it'\\''s mine' --check"), HasSubstr("\nparameters.gravity = 9.0")));
  const Said checked = service.run("treeroll-learner", {file, "--check"});
  EXPECT_EQ(checked.status, 0) << checked.errors;
}

TEST(CheckTest, SaysWhatTheStudyWouldDoAndBeginsNothing) {
  const Service service;
  const fs::path study = service.study(text_of(SwingUpStudy{.repetitions = 1, .rollouts = 40}));
  const std::vector<std::string> check = {
      study.string(), "--check", "--local-workers", "2", "--state-dir", in(service, "state")};
  const Said said = service.run("treeroll-learner", check);
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, AllOf(HasSubstr("2 conditions x 1 repetition = 2 runs"),
                                 HasSubstr("roll-outs  80, and 4 evaluations"),
                                 HasSubstr("numbers of theta: 6 in layer 1, 12 in layer 2"),
                                 HasSubstr("start    reward 0."), HasSubstr("with 2 evaluators"),
                                 HasSubstr("task.time_limit_s = 10.0")));
  EXPECT_FALSE(fs::exists(in(service, "state")));
  const auto results = [&] {
    const std::string output = service.run("treeroll-learner", check).output;
    const auto at = output.find("results    ");
    return output.substr(at, output.find('\n', at) - at);
  };
  fs::create_directory(in(service, "state"));
  EXPECT_THAT(results(), Not(HasSubstr("must be new or empty")));
  write_file(in(service, "state") + "/mine", "mine");
  EXPECT_THAT(results(), HasSubstr("must be new or empty"));
  std::vector<std::string> as_json = check;
  as_json.push_back("--json");
  const json answer = json::parse(service.run("treeroll-learner", as_json).output);
  EXPECT_EQ(answer["rollouts"], 80);
  // What it says of the start is what learning finds.
  const auto learnt = service.learn(study, {"--local-workers", "1"});
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(answer["conditions"][c]["start"]["reward"],
              learnt.summary["conditions"][c]["mean_start_reward"]);
  }
}

TEST(CheckTest, RefusesWhatTheLearnerWouldRefuse) {
  const Service service;
  const fs::path study = service.study(text_of(SwingUpStudy{}));
  const Said said =
      service.run("treeroll-learner", {study.string(), "--check", "--set", "task.duration_s=-1"});
  EXPECT_EQ(said.status, 2);
  EXPECT_THAT(said.errors, HasSubstr("task.duration_s = -1"));
}

/// Of a CSV text, the numbers of a column.
std::vector<double> column(const std::string& csv, const std::string& name) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  std::istringstream heading(line);
  int index = 0;
  for (std::string field; std::getline(heading, field, ',') && field != name;) ++index;
  std::vector<double> numbers;
  while (std::getline(lines, line)) {
    std::istringstream row(line);
    std::string field;
    for (int i = 0; i <= index; ++i) std::getline(row, field, ',');
    numbers.push_back(std::stod(field));
  }
  return numbers;
}

/// The inputs and outputs of a preview's draw, a line each.
std::string curve(const std::string& preview, const std::string& draw) {
  std::istringstream lines(preview);
  const std::string before = "plain," + draw + ",";
  std::string rows;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(before)) rows += line.substr(before.size()) + "\n";
  }
  return rows;
}

TEST(PreviewTest, ShowsTheDrawsThatLearningBeginsWith) {
  const Service service;
  const fs::path study = new_study(service, "trajectory");
  const Said said = service.run("treeroll-learner", {study.string(), "--preview", "3"});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, AllOf(HasSubstr("condition,draw,input,output_1\nplain,start,0,0\n"),
                                 HasSubstr("\nplain,0:2,"), Not(HasSubstr("0:3"))));
  EXPECT_THAT(said.errors, HasSubstr("plain: the start gives 0 to 0, 3 of 3 draws give "));

  // The second draw, as a journal has it, gives what the preview has shown.
  const auto learnt = service.learn(
      study, {"--local-workers", "1", "--set", "study.rollouts=2", "--set", "study.repetitions=1"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::string file = in(service, "drawn.json");
  const Said drawn =
      service.run("treeroll-replay", {state_of(service), "--policy", "0:1", "--output", file});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  const Said again = service.run(
      "treeroll-learner", {study.string(), "--preview", "1", "--set", "policy.start_file=" + file});
  ASSERT_EQ(again.status, 0) << again.errors;
  EXPECT_NE(curve(said.output, "0:1"), "");
  EXPECT_EQ(curve(said.output, "0:1"), curve(again.output, "start"));
}

TEST(PreviewTest, GoesOnWithTheNextRunWhereLearningWouldHaveLearnt) {
  const Service service;
  const fs::path study = new_study(service, "trajectory");
  const Said said = service.run(
      "treeroll-learner", {study.string(), "--preview", "15", "--set", "exploration.rule=\"power\"",
                           "--set", "exploration.first_update=10", "--set", "study.in_flight=1"});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, AllOf(HasSubstr("\nplain,0:9,"), Not(HasSubstr("\nplain,0:10,")),
                                 HasSubstr("\nplain,1:4,")));
}

TEST(PreviewTest, OfSeveralInputsShowsTheta) {
  const Service service;
  const fs::path study = new_study(service, "hold");
  const Said said = service.run("treeroll-learner", {study.string(), "--preview", "30"});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, AllOf(HasSubstr("condition,draw,theta_1,theta_2"),
                                 HasSubstr("\nplain,start,"), HasSubstr("\nplain,1:0,")));
}

constexpr const char* kBounded = R"(
[policy.bounds]
outside = "OUTSIDE"
output_min = [-8.0]
output_max = [8.0]
)";

std::string bounded_study(const std::string& outside) {
  std::string bounds = kBounded;
  bounds.replace(bounds.find("OUTSIDE"), 7, outside);
  std::string text = text_of(SwingUpStudy{.repetitions = 1, .rollouts = 6});
  return text.insert(text.find("[exploration]"), bounds + "\n");
}

TEST(BoundsTest, NoTaskIsEverGivenMore) {
  const Service service;
  const auto learnt = service.learn(service.study(bounded_study("clip")), {"--local-workers", "1"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::string state = state_of(service);
  const std::string trace = in(service, "trace.csv");
  const Said said =
      service.run("treeroll-evaluate", {state + "/policies/tree-0.json", state + "/study.toml",
                                        "--condition", "tree", "--trace", trace});
  ASSERT_EQ(said.status, 0) << said.errors;
  const auto given = column(read_file(trace), "cart_acceleration_mps2");
  ASSERT_FALSE(given.empty());
  EXPECT_EQ(*std::ranges::max_element(given), 8);
  EXPECT_EQ(*std::ranges::min_element(given), -8);
  const Said verified = service.run("treeroll-replay", {state, "--verify", "--refit"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
}

TEST(BoundsTest, WhatIsRefusedFailsAndSaysWhy) {
  const Service service;
  const auto learnt =
      service.learn(service.study(bounded_study("refuse")), {"--local-workers", "1"});
  EXPECT_EQ(learnt.status, 4) << learnt.log;
  EXPECT_THAT(learnt.rollouts_csv, HasSubstr("(policy.bounds)"));
  EXPECT_THAT(learnt.rollouts_csv, Not(HasSubstr(",ok,")));
}

/// A policy is worth what it was worth in its condition, or nothing is said.
TEST(BoundsTest, AreThoseOfThePolicysOwnCondition) {
  const Service service;
  std::string text = text_of(SwingUpStudy{.repetitions = 1, .rollouts = 4});
  text.erase(text.find("[[conditions]]"));
  text += R"([[conditions]]
name = "bounded"
policy.bounds.outside = "clip"
policy.bounds.output_min = [-2.0]
policy.bounds.output_max = [2.0]
[[conditions]]
name = "free"
)";
  const auto learnt = service.learn(service.study(text), {"--local-workers", "1"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::string state = state_of(service);
  std::vector<std::string> evaluate = {state + "/policies/free-0.json", state + "/study.toml",
                                       "--json"};
  const Said open = service.run("treeroll-evaluate", evaluate);
  EXPECT_EQ(open.status, 2) << open.output;
  EXPECT_THAT(open.errors, HasSubstr("--condition: must be given, for the conditions have "
                                     "different policy.bounds: bounded, free"));
  evaluate.insert(evaluate.end(), {"--condition", "free"});
  const Said said = service.run("treeroll-evaluate", evaluate);
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(learnt.runs_csv, HasSubstr("," + json::parse(said.output)["reward"].dump() + ","));
}

TEST(BoundsTest, CountForAPolicyFileAsWell) {
  const Service service;
  const fs::path study = service.study(text_of(SwingUpStudy{.repetitions = 1, .rollouts = 2}));
  ASSERT_EQ(service.learn(study, {"--local-workers", "1"}).status, 0);
  write_file(in(service, "again.toml"), bounded_study("clip"));
  const Said said = service.run(
      "treeroll-learner",
      {in(service, "again.toml"), "--preview", "2", "--set", "conditions=[{name=\"tree\"}]",
       "--set", "policy.start_file=" + state_of(service) + "/policies/tree-0.json"});
  ASSERT_EQ(said.status, 0) << said.errors;
  const auto given = column(said.output, "output_1");
  EXPECT_EQ(*std::ranges::max_element(given), 8);
  EXPECT_EQ(*std::ranges::min_element(given), -8);

  // And where it is evaluated, once, on the robot say.
  const std::string trace = in(service, "trace.csv");
  const std::string policy = state_of(service) + "/policies/tree-0.json";
  std::vector<std::string> evaluate = {
      policy, in(service, "again.toml"), "--condition", "tree", "--trace", trace};
  const Said worth = service.run("treeroll-evaluate", evaluate);
  ASSERT_EQ(worth.status, 0) << worth.errors;
  EXPECT_THAT(worth.errors, HasSubstr("the study's policy.bounds count"));
  const auto sent = column(read_file(trace), "cart_acceleration_mps2");
  EXPECT_EQ(*std::ranges::max_element(sent), 8);
  json other = json::parse(read_file(policy));
  other["bounds"] = json::parse(R"({"outside": "clip", "theta_min": [], "theta_max": [],
      "output_min": [], "output_max": [99], "output_rate_max": [], "sample_time_s": 0,
      "output_start": []})");
  write_file(evaluate.front() = in(service, "other.json"), other.dump());
  const Said refused = service.run("treeroll-evaluate", evaluate);
  EXPECT_EQ(refused.status, 2) << refused.errors;
  EXPECT_THAT(refused.errors, HasSubstr("has other bounds than the study"));
  other["bounds"]["outside"] = "refuse";
  other["bounds"]["theta_max"] = {-1e9};
  write_file(evaluate.front(), other.dump());
  evaluate[1] = study.string();
  const Said beyond = service.run("treeroll-evaluate", evaluate);
  EXPECT_EQ(beyond.status, 2) << beyond.errors;
  EXPECT_THAT(beyond.errors, HasSubstr("of theta is"));
}

}  // namespace
}  // namespace treeroll::end_to_end
