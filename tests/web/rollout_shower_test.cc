#include "learner/web/rollout_shower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/files/scratch_folder.h"

namespace treeroll::web {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// A shell script in place of the program that shows.
class RolloutShowerTest : public testing::Test {
 protected:
  void start(const std::string& script, ShowingLimits limits = {}) {
    const std::filesystem::path file = scratch_.path() / "show.sh";
    std::ofstream(file) << script;
    shower_.emplace(loop_, ShowingProgram{"/bin/sh", {file.string(), log().string()}}, limits);
  }
  std::filesystem::path log() const { return scratch_.path() / "log"; }

  /// Asks again and again, as a browser does, until there is an answer.
  RolloutShower::Shown show(protocol::RolloutKey key) {
    RolloutShower::Shown shown;
    transport::Timer timer(loop_, [&] {
      shown = shower_->show(key, true);
      if (shown.text || !shown.failure.empty()) return loop_.stop();
      timer.set(loop_.now() + milliseconds(5));
    });
    timer.set(loop_.now());
    loop_.run();
    return shown;
  }
  int times_started() const {
    std::ifstream file(log());
    int count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }

  ScratchFolder scratch_;
  transport::Loop loop_;
  std::optional<RolloutShower> shower_;
};

TEST_F(RolloutShowerTest, ShowsWhatTheProgramSaysAndAsksItOnce) {
  start("echo started >> $1; echo warning >&2; echo shown $2 at $(nice)");
  const RolloutShower::Shown shown = show({3, 17});
  ASSERT_TRUE(shown.text) << shown.failure;
  EXPECT_THAT(*shown.text, HasSubstr("shown 3:17 at 15"));
  EXPECT_EQ(show({3, 17}).text, shown.text);
  EXPECT_EQ(times_started(), 1);
  EXPECT_THAT(*show({3, -2}).text, HasSubstr("shown 3:-2"));
}

TEST_F(RolloutShowerTest, SaysWhyItCannotBeShown) {
  start("echo '12:00:01.000 error the journal is gone' >&2; exit 1");
  EXPECT_EQ(show({0, 1}).failure, "the journal is gone");
  start("kill -9 $$");
  EXPECT_THAT(show({0, 1}).failure, HasSubstr("ended with status"));
}

TEST_F(RolloutShowerTest, ShowsTheRestWhereOneThingCannotBe) {
  start("echo shown; echo 'the program is gone' >&2; exit 2");
  EXPECT_THAT(*show({0, 1}).text, HasSubstr("shown"));
  start("echo '12:00:01.000 error RUN:ROLLOUT is none' >&2; exit 2");
  EXPECT_EQ(show({0, 1}).failure, "RUN:ROLLOUT is none");
}

TEST_F(RolloutShowerTest, WhatCouldNotBeSimulatedIsTriedAgain) {
  start(
      "echo x >> $1; [ $(wc -l < $1) = 1 ] && echo '{\"again\":{\"failure\":\"no worker\"}}' || "
      "echo ok",
      {.unsettled_for = milliseconds(50)});
  EXPECT_THAT(*show({0, 1}).text, HasSubstr("no worker"));
  std::string last;
  const TimePoint end = loop_.now() + std::chrono::seconds(20);
  while (last != "ok\n" && loop_.now() < end) last = *show({0, 1}).text;
  EXPECT_EQ(last, "ok\n");
  show({0, 1});
  EXPECT_EQ(times_started(), 2);
}

TEST_F(RolloutShowerTest, EndsWhatTakesTooLongOrSaysTooMuch) {
  start("echo begun; exec sleep 60", {.time = milliseconds(200)});
  EXPECT_THAT(show({0, 1}).failure, HasSubstr("took more than 0.2 s"));
  start("exec cat /dev/zero", {.output_bytes_max = 100'000});
  EXPECT_THAT(show({0, 1}).failure, HasSubstr("more than 100000 bytes"));
}

TEST_F(RolloutShowerTest, DoesOneAtATimeAndForgetsWhoWaitsTooLong) {
  start("echo $2 >> $1; echo ok", {.waiting_max = 3});
  for (int number = 0; number < 50; ++number) shower_->show({0, number}, true);
  EXPECT_TRUE(show({0, 49}).text);
  EXPECT_LE(times_started(), 4);
}

TEST_F(RolloutShowerTest, KeepsNoMoreThanItsBytes) {
  start("echo $2 >> $1; head -c 50000 /dev/zero", {.cache_bytes_max = 120'000});
  for (int number = 0; number < 4; ++number) EXPECT_TRUE(show({0, number}).text);
  EXPECT_TRUE(show({0, 3}).text);
  EXPECT_EQ(times_started(), 4);
  EXPECT_TRUE(show({0, 0}).text);
  EXPECT_EQ(times_started(), 5);
}

}  // namespace
}  // namespace treeroll::web
