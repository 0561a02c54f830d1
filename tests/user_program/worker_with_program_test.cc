#include <gmock/gmock.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/worker_app/learner_stand_in.h"

/// A worker on the bus whose evaluators run a user's program.
namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;

struct Stage {
  Stage(int salt, std::vector<std::string> arguments)
      : learner(salt), worker(with(std::move(arguments), learner.url())) {}

  static std::vector<std::string> with(std::vector<std::string> arguments, const std::string& url) {
    arguments.insert(arguments.end(), {"--lcm-url=" + url, "--evaluator", TREEROLL_REACH});
    return arguments;
  }
  void define(const json& settings) {
    learner.define(json{{"name", "reach"}, {"settings", settings}}.dump());
  }
  /// Asks for it until it is answered: while evaluators start anew there is no room.
  Outcome outcome(int number) {
    const auto answered = [&] { return learner.result(number) != nullptr; };
    for (int i = 0; i < 30 && !answered(); ++i) {
      learner.ask(number, 1);
      if (learner.until(answered, 1s)) break;
    }
    return answered() ? learner.result(number)->outcome : Outcome();
  }

  LearnerStandIn learner;
  Child worker;
};

TEST(WorkerWithProgramTest, EvaluatesManyRolloutsWithOneProcessEach) {
  Stage stage(21, {"--processes=2"});
  ASSERT_TRUE(stage.learner.meet_worker());
  EXPECT_THAT(stage.learner.status->numeric_class, HasSubstr(" program "));
  stage.define({{"goal_m", 1}});
  stage.learner.ask(0, 60);
  ASSERT_TRUE(stage.learner.until([&] {
    for (int i = 0; i < 60; ++i) {
      if (stage.learner.result(i) == nullptr) return false;
    }
    return true;
  }));
  EXPECT_EQ(stage.learner.result(59)->outcome, Outcome::ok(1));
  for (const pid_t evaluator : children_of(stage.worker.pid())) {
    EXPECT_THAT(children_of(evaluator), SizeIs(1));
  }
  stage.learner.acknowledge();
  stage.worker.signal(SIGTERM);
  EXPECT_EQ(stage.worker.wait(), 0);
}

TEST(WorkerWithProgramTest, ReportsARefusalAndHasTwoTasksByTurns) {
  Stage stage(22, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.define({{"goal_m", "far"}});
  ASSERT_TRUE(stage.learner.until([&] { return !stage.learner.reports.empty(); }));
  EXPECT_FALSE(stage.learner.reports[0].accepted);
  EXPECT_THAT(stage.learner.reports[0].text, HasSubstr("task.goal_m = \"far\": must be a number"));
  for (int i = 0; i < 6; ++i) {
    stage.define({{"goal_m", i % 2}});
    EXPECT_EQ(stage.outcome(i), Outcome::ok(i % 2 == 1 ? 1 : .5)) << i;
  }
}

TEST(WorkerWithProgramTest, ADescriptionMadeAgainIsNoPartOfARolloutsTime) {
  Stage stage(26, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  for (int i = 0; i < 4; ++i) {
    stage.define({{"goal_m", i % 2}, {"mode", "describes_slowly"}, {"time_limit_s", .2}});
    EXPECT_EQ(stage.outcome(i), Outcome::ok(i % 2 == 1 ? 1 : .5)) << i;
  }
}

TEST(WorkerWithProgramTest, WhatEndsAProgramThriceIsAnsweredSo) {
  Stage stage(23, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  int number = 0;
  for (const char* mode : {"segfault", "exits", "closes_output"}) {
    stage.define({{"mode", mode}});
    EXPECT_EQ(stage.outcome(number++).status(), RolloutStatus::kCrashed) << mode;
  }
  for (const char* mode : {"burns", "child_burns", "sleeps"}) {
    stage.define({{"mode", mode}, {"time_limit_s", .2}});
    EXPECT_EQ(stage.outcome(number++).status(), RolloutStatus::kTimedOut) << mode;
  }
  stage.define({{"mode", "discards_first"}});
  EXPECT_TRUE(stage.outcome(number++).is_discarded());
  stage.define({{"mode", "descriptors"}});
  EXPECT_EQ(stage.outcome(number++), Outcome::ok(.8));
  stage.define(json::object());
  EXPECT_EQ(stage.outcome(number++), Outcome::ok(.8)) << "it goes on";
  EXPECT_THAT(stage.worker.errors(), HasSubstr("in run 0, roll-out 1: the arm is gone"));
  EXPECT_THAT(stage.worker.errors(), HasSubstr("ended with status 3"));
}

TEST(WorkerWithProgramTest, AProgramPastItsTimeMayStopItsMotors) {
  Stage stage(27, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.define({{"mode", "moves"}, {"time_limit_s", .2}});
  EXPECT_EQ(stage.outcome(0).status(), RolloutStatus::kTimedOut);
  EXPECT_THAT(stage.worker.errors(), HasSubstr("in run 0, roll-out 0: motors off"));
}

TEST(WorkerWithProgramTest, AProgramOfAWorkerThatEndsMayStopItsMotors) {
  Stage stage(28, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.define({{"mode", "moves"}, {"time_limit_s", 1000}});
  stage.learner.ask(0, 1);
  const auto has_said = [&](const char* words) {
    return [&stage, words] { return stage.worker.errors().find(words) != std::string::npos; };
  };
  ASSERT_TRUE(stage.learner.until(has_said("roll-out 0: moves")));
  stage.worker.signal(SIGTERM);
  ASSERT_TRUE(stage.learner.until(has_said("draining")));
  stage.worker.signal(SIGTERM);  // in haste
  EXPECT_EQ(stage.worker.wait(), 1);
  EXPECT_THAT(stage.worker.errors(), HasSubstr("roll-out 0: motors off"));
}

TEST(WorkerWithProgramTest, WantOfMemoryEndsAProgram) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer has more memory than any limit allows";
#endif
  Stage stage(25, {"--processes=1", "--memory-limit-mb=500"});
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.define({{"mode", "memory"}});
  EXPECT_EQ(stage.outcome(0).status(), RolloutStatus::kCrashed);
  EXPECT_THAT(stage.worker.errors(), HasSubstr("in run 0, roll-out 0: no memory"));
  stage.define(json::object());
  EXPECT_EQ(stage.outcome(1), Outcome::ok(.8)) << "it goes on";
}

TEST(WorkerWithProgramTest, LeavesNoProgramBehindWhenItIsKilled) {
  Stage stage(24, {"--processes=1"});
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.define({{"mode", "child_burns"}, {"time_limit_s", 1000}});
  stage.learner.ask(0, 1);
  std::vector<pid_t> family;
  ASSERT_TRUE(stage.learner.until([&] {
    family = {stage.worker.pid()};
    for (std::size_t i = 0; i < family.size(); ++i) {
      for (const pid_t child : children_of(family[i])) family.push_back(child);
    }
    return family.size() >= 4;  // worker, evaluator, program, what it has started
  }));
  stage.worker.signal(SIGKILL);
  EXPECT_EQ(stage.worker.wait(), -SIGKILL);
  EXPECT_TRUE(stage.learner.until([&] { return !is_alive(family[1]) && !is_alive(family[2]); }));
  // What a program has started is its own to end: here all of the evaluator's group that is left.
  kill(-family[1], SIGKILL);
}

/// All that descends from it, zombies too.
std::vector<std::string> lines_of_family(pid_t pid) {
  std::vector<pid_t> family{pid};
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < family.size(); ++i) {
    const std::string place = "/proc/" + std::to_string(family[i]);
    std::ifstream children(place + "/task/" + std::to_string(family[i]) + "/children");
    for (pid_t child = 0; children >> child;) family.push_back(child);
    std::getline(std::ifstream(place + "/stat"), lines.emplace_back());
  }
  return lines;
}

TEST(WorkerWithProgramTest, TheFirstProcessOfAContainerReapsWhatProgramsLeaveBehind) {
  const std::string unshare = "/usr/bin/unshare";
  const std::vector<std::string> as_first{"--user", "--map-root-user", "--pid", "--fork",
                                          "--kill-child"};
  auto words = as_first;
  words.emplace_back("/bin/true");
  if (Child(words, "", unshare).wait() != 0) GTEST_SKIP() << "no namespaces here";
  LearnerStandIn learner(29);
  words = as_first;
  for (const auto& word : Stage::with({TREEROLL_WORKER_PROGRAM, "--processes=1"}, learner.url())) {
    words.push_back(word);
  }
  Child container(words, "", unshare);
  ASSERT_TRUE(learner.meet_worker());
  const auto count = [&](const char* what) {
    return std::ranges::count_if(lines_of_family(container.pid()), [&](const std::string& line) {
      return line.find(what) != std::string::npos;
    });
  };
  const pid_t first_process = children_of(container.pid()).at(0);
  // Of a program, but for one that is left to the first process and about to end.
  const auto evaluator = [&] {
    pid_t found = 0;
    for (const std::string& line : lines_of_family(container.pid())) {
      const std::string name = "(python3) ";  // then its state, a letter, and its parent
      const std::size_t state = line.find(name);
      if (state == std::string::npos || line[state + name.size()] == 'Z') continue;
      const pid_t parent = std::stoi(line.substr(state + name.size() + 2));
      if (parent != first_process) found = parent;
    }
    return found;
  };
  // One that is killed leaves its program to the first process.
  for (int i = 0; i < 3; ++i) {
    pid_t alive = 0;
    ASSERT_TRUE(learner.until([&] { return alive != 0 || (alive = evaluator()) != 0; }));
    kill(alive, SIGKILL);
    pid_t next = 0;
    const auto is_another = [&] { return next != 0 && next != alive; };
    ASSERT_TRUE(learner.until([&] { return is_another() || (next = evaluator(), is_another()); }));
  }
  EXPECT_TRUE(learner.until([&] { return count(") Z") == 0; }));
  kill(first_process, SIGTERM);
  EXPECT_EQ(container.wait(), 0) << "it was passed on, once";
  EXPECT_THAT(container.errors(), testing::Not(HasSubstr("twice")));
}

TEST(WorkerWithProgramTest, RefusesACommandThatNamesNoProgram) {
  Child worker({"--evaluator", "nobody-has-this x"});
  EXPECT_EQ(worker.wait(), 2);
  EXPECT_THAT(worker.errors(), HasSubstr("--evaluator"));
  Child odd({"--numeric-class", "two\nlines"});
  EXPECT_EQ(odd.wait(), 2);
  EXPECT_THAT(odd.errors(), HasSubstr("--numeric-class"));
}

}  // namespace
}  // namespace treeroll::worker
