#include "learner/worker_program/process.h"

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

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

TEST(EndChildTest, AsksTwiceBeforeItKills) {
  const std::filesystem::path told =
      std::filesystem::path(testing::TempDir()) / "treeroll_end_child_test";
  std::filesystem::remove(told);
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
  std::filesystem::remove(told);
}

}  // namespace
}  // namespace treeroll
