// A task in another language, from the study to the report: tests/user_program/reach.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

class AnyLanguageTest : public ::testing::Test {
 protected:
  Service::Learnt learn(const std::string& state, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {study_.string(), "--json", "--lcm-url", service_.url(),
                                         "--state-dir", (service_.directory() / state).string()});
    Daemon learner("treeroll-learner", arguments, service_.directory());
    return service_.learnt(learner, state, seconds(100));
  }

  const Service service_;
  const fs::path study_ =
      service_.study(reach_study("name = \"reach\"\nrollouts = 40\nrepetitions = 2"));
};

TEST_F(AnyLanguageTest, IsLearntReplayedEvaluatedAndReported) {
  const Service::Learnt learnt =
      learn("one", {"--local-workers", "1", "--evaluator", TREEROLL_REACH});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["ledger"]["failed"], 0) << learnt.log;
  EXPECT_GT(learnt.summary["conditions"][0]["median_best_reward"], .99) << learnt.summary;
  EXPECT_THAT(learnt.summary["numeric_classes"].dump(), HasSubstr(" program "));

  const Service::Learnt again =
      learn("three", {"--local-workers", "3", "--evaluator", TREEROLL_REACH});
  ASSERT_EQ(again.status, 0) << again.log;
  EXPECT_EQ(again.rollouts_csv, learnt.rollouts_csv) << "the same bits with any number of them";

  const std::string state = (service_.directory() / "one").string();
  const Said replay = service_.run("treeroll-replay", {state, "--verify"});
  EXPECT_EQ(replay.status, 0) << replay.errors;

  const std::string trace = (service_.directory() / "trace.csv").string();
  const Said evaluated = service_.run(
      "treeroll-evaluate", {state + "/policies/flat-0.json", state + "/study.toml", "--evaluator",
                            TREEROLL_REACH, "--trace", trace, "--json"});
  ASSERT_EQ(evaluated.status, 0) << evaluated.errors;
  const nlohmann::json said = nlohmann::json::parse(evaluated.output);
  EXPECT_THAT(learnt.runs_csv, HasSubstr("," + said["reward"].dump() + ",")) << said;
  EXPECT_TRUE(said["terms"].contains("miss_m")) << said;
  EXPECT_THAT(read_file(trace), HasSubstr("time_s,x_m\n0,0\n"));

  const Said report =
      service_.run("treeroll-report", {state, "--evaluator", TREEROLL_REACH, "--output",
                                       (service_.directory() / "report").string()});
  EXPECT_EQ(report.status, 0) << report.errors;
  EXPECT_THAT(read_file(service_.directory() / "report/report.md"), HasSubstr("reach"));
  EXPECT_THAT(report.errors, testing::Not(HasSubstr("reach.py"))) << "no roll-out is lacking";
}

/// A task that may be a robot is run for the study, and where a person asks for it; no program
/// moves it to show something.
TEST_F(AnyLanguageTest, WhatIsNotRepeatableIsNotRunToBeShown) {
  const fs::path started = service_.directory() / "started";
  const fs::path robot = service_.directory() / "robot.sh";
  write_file(robot,
             "#!/bin/sh\necho started >> " + started.string() + "\nexec " + TREEROLL_REACH + "\n");
  fs::permissions(robot, fs::perms::owner_all);
  const Service::Learnt learnt = learn("robot", {"--local-workers", "1", "--evaluator",
                                                 robot.string(), "--set", "task.mode=\"robot\""});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::string before = read_file(started);
  ASSERT_FALSE(before.empty());

  const std::string state = (service_.directory() / "robot").string();
  const Said shown =
      service_.run("treeroll-replay", {state, "--show", "0:3", "--evaluator", robot.string()});
  ASSERT_EQ(shown.status, 0) << shown.errors;
  const nlohmann::json rollout = nlohmann::json::parse(shown.output);
  EXPECT_FALSE(rollout["policy"].is_null());
  EXPECT_THAT(rollout["again"].dump(), HasSubstr("repeatable = false"));
  const fs::path report = service_.directory() / "report";
  const Said reported = service_.run(
      "treeroll-report", {state, "--evaluator", robot.string(), "--output", report.string()});
  EXPECT_EQ(reported.status, 0) << reported.errors;
  EXPECT_THAT(read_file(report / "report.md"), HasSubstr("would move for a picture"));
  EXPECT_EQ(read_file(started), before) << "nobody asked for a trial";

  const Said evaluated = service_.run(
      "treeroll-evaluate",
      {state + "/policies/flat-0.json", state + "/study.toml", "--evaluator", robot.string()});
  EXPECT_EQ(evaluated.status, 0) << evaluated.errors;
  EXPECT_THAT(evaluated.output, HasSubstr("status  ok"));
  EXPECT_NE(read_file(started), before);
}

TEST_F(AnyLanguageTest, IsRefusedBeforeAnythingStarts) {
  const Service::Learnt refused = learn(
      "refused", {"--local-workers", "1", "--evaluator", TREEROLL_REACH, "--set", "task.goal=1"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.log, HasSubstr("task.goal = 1: is no setting of this task"));
  EXPECT_FALSE(fs::exists(service_.directory() / "refused"));
  const Service::Learnt nobody =
      learn("nobody", {"--local-workers", "1", "--evaluator", "python3 /nobody/has/this.py"});
  EXPECT_EQ(nobody.status, 2);
  EXPECT_THAT(nobody.log, HasSubstr("No such file"));
}

/// A service manager starts a program anew after any status but 2 (deploy/systemd).
TEST_F(AnyLanguageTest, AProgramThatCannotBeStartedIsBadInputWhoeverAsksIt) {
  const Service::Learnt learnt =
      learn("state", {"--local-workers", "1", "--evaluator", TREEROLL_REACH});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::string state = (service_.directory() / "state").string();
  const fs::path plain = service_.directory() / "plain.py";
  write_file(plain, "#!/usr/bin/env python3\n");
  const fs::path orphan = service_.directory() / "orphan.py";
  write_file(orphan, "#!/nobody/has/this/python3\n");
  fs::permissions(orphan, fs::perms::owner_all);

  const std::string study = study_.string();
  const std::string policy = state + "/policies/flat-0.json";
  const std::string other = (service_.directory() / "other").string();
  const std::vector<std::vector<std::string>> askers = {
      {"treeroll-learner", study, "--lcm-url", service_.url(), "--state-dir", other},
      {"treeroll-learner", study, "--check"},
      {"treeroll-learner", "--new", other + ".toml", "--task", "reach"},
      {"treeroll-evaluate", policy, study},
      {"treeroll-report", state, "--output", (service_.directory() / "report").string()},
      {"treeroll-replay", state, "--show", "0:3"},
      {"treeroll-replay", state, "--http", "0"}};
  for (const auto& [command, why] :
       {std::pair(plain.string(), "can be executed"),
        std::pair(orphan.string(), "its first line names"),
        std::pair(std::string("python3 /nobody/has/this.py"), "No such file")}) {
    for (std::vector<std::string> words : askers) {
      // That of a page is asked when somebody looks: only its command is looked at before.
      if (words.back() == "0" && command != plain.string()) continue;
      const std::string program = words.front();
      words.erase(words.begin());
      words.insert(words.end(), {"--evaluator", command});
      const Said said = service_.run(program, words);
      EXPECT_EQ(said.status, 2) << program << ' ' << words[1] << ' ' << command << said.errors;
      EXPECT_THAT(said.errors, HasSubstr(why)) << program << ' ' << words[1];
      EXPECT_FALSE(fs::exists(other) || fs::exists(other + ".toml")) << "something was begun";
    }
  }
  const Said shown =
      service_.run("treeroll-replay", {state, "--show", "0:3", "--evaluator", orphan.string()});
  EXPECT_FALSE(nlohmann::json::parse(shown.output)["policy"].is_null()) << "the rest is shown";
}

TEST_F(AnyLanguageTest, TheSettingsOfOurTasksAreNotShownForIts) {
  for (const auto& [program, option] : {std::pair("treeroll-worker", "--help-tasks"),
                                        std::pair("treeroll-learner", "--help-keys")}) {
    const Said said = service_.run(program, {option, "goal", "--evaluator", TREEROLL_REACH});
    EXPECT_EQ(said.status, 2) << said.output;
    EXPECT_EQ(said.output, "");
    EXPECT_THAT(said.errors, HasSubstr("--evaluator"));
  }
  const Said said =
      service_.run("treeroll-learner", {study_.string(), "--check", "--evaluator", TREEROLL_REACH});
  EXPECT_THAT(said.output, HasSubstr("task.mode = \"well\"")) << said.errors;
}

TEST_F(AnyLanguageTest, ItsChecksAreAProgram) {
  Said said = service_.run("treeroll-check-evaluator", {TREEROLL_REACH, "--name", "reach"});
  EXPECT_EQ(said.status, 0) << said.output << said.errors;
  EXPECT_THAT(said.output, HasSubstr("can be used as an evaluator"));
  said = service_.run("treeroll-check-evaluator",
                      {TREEROLL_REACH, "--name", "reach", "--settings", R"({"mode": "twice"})"});
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.output, HasSubstr("BROKEN     rule  6"));
  for (const std::vector<std::string>& bad : {std::vector<std::string>{},
                                              {"nobody-has-this"},
                                              {TREEROLL_REACH, "--settings", "[]"},
                                              {TREEROLL_REACH, "--policy", "/nobody/has/this"}}) {
    EXPECT_EQ(service_.run("treeroll-check-evaluator", bad).status, 2) << bad.size();
  }
}

}  // namespace
}  // namespace treeroll::end_to_end
