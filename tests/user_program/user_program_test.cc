#include "workers/user_program/user_program.h"

#include <gmock/gmock.h>

#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/program/program_command.h"
#include "tests/worker_app/learner_stand_in.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// The program of reach.py, or another one.
class UserProgramTest : public testing::Test {
 protected:
  UserProgram& start(const std::string& command = TREEROLL_REACH) {
    program_.emplace(ProgramSettings{command, read_program_command("--evaluator", command)},
                     [this](const std::string& where, const std::string& line) {
                       log_.push_back(where + ": " + line);
                     });
    return *program_;
  }
  EvaluateAnswer evaluate(const std::string& mode, Trace* trace = nullptr) {
    const DescribeAnswer task = program_->describe("reach", {{"mode", mode}});
    return program_->evaluate({.run = 3, .rollout = 17, .seed = 5, .policy = policy_},
                              task.description, trace);
  }
  /// How the program ended under a roll-out.
  ProgramEnded end_of(const std::string& mode) {
    try {
      evaluate(mode);
    } catch (const ProgramEnded& ended) {
      return ended;
    }
    ADD_FAILURE() << "it has not ended";
    return {};
  }

  const std::string policy_ = to_json(small_policy());  // its output's mean is .25
  std::vector<std::string> log_;
  std::optional<UserProgram> program_;
};

TEST_F(UserProgramTest, DescribesAndEvaluatesAsOftenAsItIsAsked) {
  UserProgram& program = start();
  const DescribeAnswer task = program.describe("reach", {{"goal_m", .25}});
  EXPECT_EQ(json::parse(*task.settings),
            json::parse(R"({"goal_m": 0.25, "mode": "well", "time_limit_s": 10})"));
  for (int i = 0; i < 100; ++i) {
    const EvaluateAnswer answer =
        program.evaluate({.rollout = i, .policy = policy_}, task.description, nullptr);
    ASSERT_EQ(answer.outcome, Outcome::ok(1));
    ASSERT_EQ(answer.terms.at("miss_m"), 0);
  }
}

TEST_F(UserProgramTest, ARefusalNamesTheSettingItIsAbout) {
  UserProgram& program = start();
  const auto refused = [&](const std::string& name, const json& settings) {
    try {
      program.describe(name, settings);
    } catch (const ConfigError& error) {
      return error.key() + " = " + error.value() + ": " + error.rule();
    }
    return std::string();
  };
  EXPECT_EQ(refused("reach", {{"goal_m", "far"}}), "task.goal_m = \"far\": must be a number");
  EXPECT_EQ(refused("fetch", json::object()), "task.name = \"fetch\": must be reach");
  EXPECT_THAT(refused("reach", {{"mode", "describes_nonsense"}}), HasSubstr("input_dim"));
  EXPECT_EQ(program.describe("reach", json::object()).description.input_dim, 1) << "it goes on";
}

TEST_F(UserProgramTest, WhatItPrintsGoesToTheLogWithRunAndRollout) {
  start();
  EXPECT_TRUE(evaluate("chatty").outcome.is_ok());
  EXPECT_THAT(log_, Contains("in run 3, roll-out 17: a line of standard output [2J  "));
  EXPECT_THAT(log_, Contains("in run 3, roll-out 17: a line of standard error"));
}

TEST_F(UserProgramTest, AnAnswerThatBreaksARuleFailsItsRolloutAlone) {
  start();
  for (const char* mode : {"nan", "too_much", "nothing", "two_words", "unknown_key"}) {
    EXPECT_EQ(evaluate(mode).outcome.status(), RolloutStatus::kFailed) << mode;
  }
  EXPECT_EQ(evaluate("failed").outcome.reason(), "arm hit the  table");
  EXPECT_TRUE(evaluate("well").outcome.is_ok());
}

TEST_F(UserProgramTest, GivesATraceWhereItIsAsked) {
  start();
  Trace trace;
  EXPECT_TRUE(evaluate("well", &trace).outcome.is_ok());
  EXPECT_EQ(trace.numbers().size(), 6);
  EXPECT_EQ(trace.poses().size(), 3);
  Trace none;
  EXPECT_EQ(evaluate("bad_trace", &none).outcome.status(), RolloutStatus::kFailed);
}

TEST_F(UserProgramTest, ItsEndIsToldAsItWas) {
  start();
  const ProgramEnded exited = end_of("exits");
  EXPECT_TRUE(exited.end.exited);
  EXPECT_EQ(exited.end.code, 3);
  EXPECT_THAT(exited.what, HasSubstr("ended with status 3 in run 3, roll-out 17"));
  EXPECT_THAT(exited.what, HasSubstr("the arm is gone"));
  start();
  const ProgramEnded crashed = end_of("segfault");
  EXPECT_FALSE(crashed.end.exited);
  EXPECT_EQ(crashed.end.code, SIGSEGV);
  start();
  const ProgramEnd stopped = end_of("handles_sigterm").end;
  EXPECT_FALSE(stopped.exited) << "it has handled the signal, and says so by its status";
  EXPECT_EQ(stopped.code, SIGTERM);
  start();
  const ProgramEnded silent = end_of("closes_output");
  EXPECT_TRUE(silent.end.exited) << "that it was killed is nobody else's doing";
  EXPECT_EQ(silent.end.code, 1);
}

TEST_F(UserProgramTest, OneThatAnswersTwiceIsEndedBeforeAnAnswerGoesAstray) {
  start();
  EXPECT_EQ(evaluate("twice").outcome, Outcome::ok(0));
  EXPECT_THROW(program_->attend_for(std::chrono::seconds(10)), ProgramEnded);
}

TEST_F(UserProgramTest, ALineWithoutAnEndIsItsEnd) {
  start();
  EXPECT_THAT(end_of("long_line").what, HasSubstr("a line of more than 1048576 bytes"));
}

TEST_F(UserProgramTest, StandardErrorWithoutABreakIsCutAndEndsNobody) {
  start(
      "python3 -c 'import sys; sys.stdin.readline(); sys.stderr.write(\"x\" * 3000000); "
      "print(\"{\\\"refused\\\": \\\"no\\\"}\", flush=True); sys.stdin.readline()'");
  EXPECT_THROW(program_->describe("big", json::object()), ConfigError);
  EXPECT_GT(log_.size(), 40U);  // 3 000 000 bytes, but for what a pipe holds
  for (const std::string& piece : log_) EXPECT_LE(piece.size(), 65'536 + 100U);
}

TEST_F(UserProgramTest, AQuestionOfAnySizeAndMuchTalkDoNotStop) {
  // It writes more than a pipe holds before it reads, and is asked more than a pipe holds.
  start(
      "python3 -c 'import sys; print(\"x\" * 70 + \"\\n\", end=\"\") or "
      "[print(\"y\" * 70) for i in range(5000)]; "
      "[print(\"{\\\"refused\\\": \\\"%d bytes\\\"}\" % len(line), flush=True) for line in "
      "sys.stdin]'");
  try {
    program_->describe("big", {{"numbers", std::string(900'000, 'z')}});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.rule(), HasSubstr("9000"));
  }
  EXPECT_EQ(log_.size(), 5001);
}

TEST_F(UserProgramTest, OneThatTalksWithoutAPauseIsEndedWhereItIsAskedAndKeepsNobodyElseWaiting) {
  start("yes talk");
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  ASSERT_EQ(write(ends[1], "x", 1), 1);
  program_->attend(ends[0]);
  for (const int end : ends) close(end);
  program_->set_answer_limit(std::chrono::milliseconds(200));
  EXPECT_THROW(program_->describe("reach", json::object()), ProgramEnded);
}

TEST_F(UserProgramTest, OneThatTalksInsteadOfAnsweringIsEndedOnceItsTimeIsUp) {
  start("sh -c 'read line; yes talk'");
  program_->set_answer_limit(std::chrono::milliseconds(200));
  EXPECT_THROW(program_->describe("reach", json::object()), ProgramEnded);
}

TEST_F(UserProgramTest, ItsEndIsToldWhileWhatItHasStartedHoldsItsOutput) {
  start(
      "python3 -c 'import os, subprocess, sys; "
      "print(subprocess.Popen([\"sleep\", \"300\"]).pid, file=sys.stderr, flush=True); "
      "sys.stdin.readline(); os.abort()'");
  try {
    program_->describe("reach", json::object());
    FAIL();
  } catch (const ProgramEnded& ended) {
    EXPECT_EQ(ended.end.code, SIGABRT);
  }
  ASSERT_FALSE(log_.empty());
  const pid_t sleeper = std::stoi(log_[0].substr(log_[0].rfind(' ')));
  EXPECT_TRUE(is_alive(sleeper)) << "nothing was waited for";
  kill(sleeper, SIGKILL);
}

/// Also one that does not listen to SIGTERM, as who has started it does.
TEST_F(UserProgramTest, OneThatLeadsAGroupTakesAlongWhatItHasStarted) {
  for (const std::string sleeping : {"sleep 300", "(trap \"\" TERM; exec sleep 300)"}) {
    log_.clear();
    start("setsid sh -c '" + sleeping + " & echo at $! >&2; read line; sleep 300'");
    program_->set_answer_limit(std::chrono::seconds(2));
    EXPECT_THROW(program_->describe("reach", json::object()), ProgramEnded);
    ASSERT_FALSE(log_.empty());
    const pid_t sleeper = std::stoi(log_[0].substr(log_[0].rfind(' ')));
    // Whoever adopts it need not reap it at once: a zombie is no sleeper any more.
    const auto runs = [&] {
      std::ifstream stat("/proc/" + std::to_string(sleeper) + "/stat");
      std::string line;
      return std::getline(stat, line) && line.find(") Z") == std::string::npos;
    };
    for (int i = 0; i < 200 && runs(); ++i) usleep(50'000);
    EXPECT_FALSE(runs()) << sleeping;
    if (is_alive(sleeper)) kill(sleeper, SIGKILL);
  }
}

TEST_F(UserProgramTest, OneThatIsEndedMayStopItsMotors) {
  start();
  program_->set_answer_limit(std::chrono::milliseconds(500));
  EXPECT_EQ(end_of("moves").rule, 3);
  EXPECT_THAT(log_, Contains("in run 3, roll-out 17: motors off"));
  log_.clear();
  start();
  end_of("moves_in_a_long_line");
  EXPECT_THAT(log_, Contains("in run 3, roll-out 17: motors off"));
  start();
  program_->set_answer_limit(std::chrono::milliseconds(500));
  const pid_t pid = program_->process().pid();
  end_of("moves_on");  // which does not listen
  program_.reset();
  EXPECT_FALSE(is_alive(pid));
}

TEST_F(UserProgramTest, ItEndsWithItsObject) {
  start();
  const pid_t pid = program_->process().pid();
  EXPECT_TRUE(is_alive(pid));
  program_.reset();
  EXPECT_FALSE(is_alive(pid));
}

TEST_F(UserProgramTest, ThatCannotBeStartedIsAnError) {
  EXPECT_THROW(UserProgram({"x", {"/nobody/has/this"}}, {}), std::runtime_error);
}

}  // namespace
}  // namespace treeroll::worker
