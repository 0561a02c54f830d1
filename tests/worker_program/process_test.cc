#include "learner/worker_program/process.h"

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "learner/worker_program/worker_evaluation.h"
#include "tests/files/scratch_folder.h"

namespace treeroll {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

Result<ProgramOutput> shell(const std::string& script, const std::string& input = "",
                            seconds limit = seconds(60)) {
  return run_program("/bin/sh", {"-c", script}, input, limit);
}

TEST(RunProgramTest, GivesInputAndReturnsOutputAndStatus) {
  const Result<ProgramOutput> ran = shell("cat; exit 3", "some text");
  ASSERT_TRUE(ran);
  EXPECT_EQ(ran->output, "some text");
  EXPECT_EQ(ran->exit_status, 3);
}

TEST(RunProgramTest, OneThatClosesItsOutputAndGoesOnIsEndedAtItsLimit) {
  const Result<ProgramOutput> ran = shell("exec >&-; exec sleep 600", "", seconds(1));
  ASSERT_FALSE(ran);
  EXPECT_THAT(ran.error().message, HasSubstr("takes too long"));
}

TEST(RunProgramTest, OneThatSaysNothingIsEndedAtItsLimit) {
  EXPECT_FALSE(shell("exec sleep 600", "", seconds(1)));
}

TEST(RunProgramTest, OneThatDoesNotReadItsInputDoesNoHarm) {
  const Result<ProgramOutput> ran = shell("exec <&-; echo done", std::string(1'000'000, 'x'));
  ASSERT_TRUE(ran);
  EXPECT_EQ(ran->output, "done\n");
}

TEST(RunProgramTest, OneThatSaysTooMuchIsEnded) {
  const Result<ProgramOutput> ran = shell("yes");
  ASSERT_FALSE(ran);
  EXPECT_THAT(ran.error().message, HasSubstr("more than 1000000 bytes"));
}

TEST(RunProgramTest, ABrokenPipeEndsItAsItWouldInAShell) {
  const Result<ProgramOutput> ran = shell("yes | head -n 1");
  ASSERT_TRUE(ran);
  EXPECT_EQ(ran->output, "y\n");
}

TEST(RunProgramTest, WhatCannotBeExecutedIsSaid) {
  const Result<ProgramOutput> ran = run_program("/nonexistent/program", {}, "", seconds(10));
  ASSERT_FALSE(ran);
  EXPECT_THAT(ran.error().message, HasSubstr("cannot be executed"));
}

/// How a worker executable that is this script ends.
Outcome outcome_with(const std::string& script) {
  const ScratchFolder folder;
  const std::filesystem::path program = folder.path() / "worker";
  std::ofstream(program) << "#!/bin/sh\n" << script << '\n';
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  return evaluate_with({.path = program, .evaluator = {}}, {.time_limit_s = .2},
                       {.task_content = "{}", .policy_text = "{}"})
      .outcome;
}

TEST(EvaluateWithTest, TellsWhoWasKilledFromWhoWasPastTheLimit) {
  const Outcome killed = outcome_with("kill -KILL $$");
  EXPECT_EQ(killed.status(), RolloutStatus::kCrashed);
  EXPECT_EQ(killed.reason(), "was ended by signal 9, for want of memory most likely");
  const Outcome late = outcome_with("ulimit -t 1; trap '' XCPU; while :; do :; done");
  EXPECT_EQ(late.status(), RolloutStatus::kTimedOut);
}

TEST(EndChildTest, AsksTwiceBeforeItKills) {
  const ScratchFolder folder;
  const std::filesystem::path told = folder.path() / "told";
  const std::string script = "trap 'trap \"echo in haste > " + told.string() +
                             "; exit\" TERM; echo > " + told.string() + "' TERM; : > " +
                             told.string() + "; while :; do sleep .02; done";
  const Result<pid_t> child = start_child("/bin/sh", {"-c", script});
  ASSERT_TRUE(child);
  while (!std::filesystem::exists(told)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  end_child(*child, std::chrono::milliseconds(500));
  EXPECT_NE(kill(*child, 0), 0);
  std::ifstream said(told);
  std::string line;
  std::getline(said, line);
  EXPECT_EQ(line, "in haste");
}

}  // namespace
}  // namespace treeroll
