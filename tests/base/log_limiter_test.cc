#include "common/base/log_limiter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace treeroll {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class LogLimiterTest : public ::testing::Test {
 protected:
  /// The texts that pass.
  std::vector<std::string> add(std::string_view kind, const std::string& text) {
    std::vector<LogLine> lines;
    limiter_.add(now_, {LogLine::Level::kWarning, kind, text}, lines);
    return texts(lines);
  }
  std::vector<std::string> due() {
    std::vector<LogLine> lines;
    limiter_.tell_due(now_, lines);
    return texts(lines);
  }
  std::vector<std::string> rest() {
    std::vector<LogLine> lines;
    limiter_.tell_rest(now_, lines);
    return texts(lines);
  }
  void fill(std::string_view kind) {
    for (int i = 0; i < LogLimiter::kLinesMax; ++i) EXPECT_THAT(add(kind, "x"), SizeIs(1));
  }

  static std::vector<std::string> texts(const std::vector<LogLine>& lines) {
    std::vector<std::string> texts;
    for (const LogLine& line : lines) texts.push_back(line.text);
    return texts;
  }

  LogLimiter limiter_;
  TimePoint now_ = TimePoint(1h);
};

TEST_F(LogLimiterTest, WhatStrangersSayIsOneLineAndSteersNoTerminal) {
  EXPECT_THAT(add("hosts", "worker 1 (a\n2026-01-01 learner: done\x1b[2J\xc2\x9b"),
              ElementsAre("worker 1 (a 2026-01-01 learner: done [2J "));
  for (int i = 0; i < 2 * LogLimiter::kLinesMax; ++i) add("hosts", "a\nb");
  now_ += 60s;
  EXPECT_THAT(due(), ElementsAre(HasSubstr("the last: a b")));
}

TEST_F(LogLimiterTest, TheFirstFewPassAndTheOthersAreOneLineAPeriod) {
  fill("joins");
  for (int i = 0; i < 4711; ++i) EXPECT_THAT(add("joins", std::to_string(i)), IsEmpty());
  now_ += 59s;
  EXPECT_THAT(due(), IsEmpty());
  now_ += 1s;
  EXPECT_THAT(due(), ElementsAre("joins: 4711 more in the last 60 s, the last: 4710"));
  EXPECT_THAT(due(), IsEmpty());
}

TEST_F(LogLimiterTest, AFloodThatGoesOnHasASummaryAPeriodAndNothingElse) {
  std::size_t num_lines = 0;
  for (int second = 0; second < 24 * 3600; ++second, now_ += 1s) {
    num_lines += due().size();
    for (int i = 0; i < 3; ++i) num_lines += add("joins", "x").size();
  }
  EXPECT_EQ(num_lines, LogLimiter::kLinesMax + 24 * 60 - 1);
}

TEST_F(LogLimiterTest, AfterAQuietPeriodTheFirstFewPassAgain) {
  fill("joins");
  EXPECT_THAT(add("joins", "y"), IsEmpty());
  now_ += 60s;
  EXPECT_THAT(due(), SizeIs(1));
  now_ += 59s;
  EXPECT_THAT(add("joins", "soon"), IsEmpty());
  now_ += 1s;
  EXPECT_THAT(due(), ElementsAre("joins: 1 more in the last 60 s, the last: soon"));
  now_ += 60s;
  fill("joins");
}

TEST_F(LogLimiterTest, RareLinesAllPass) {
  for (int i = 0; i < 100; ++i, now_ += 7s) EXPECT_THAT(add("joins", "x"), SizeIs(1));
}

TEST_F(LogLimiterTest, KindsDoNotShareTheirRoom) {
  fill("joins");
  EXPECT_THAT(add("joins", "x"), IsEmpty());
  EXPECT_THAT(add("leaves", "y"), ElementsAre("y"));
}

TEST_F(LogLimiterTest, ALineThatComesWhenThePeriodIsOverFollowsItsSummary) {
  fill("joins");
  add("joins", "late");
  now_ += 61s;
  EXPECT_THAT(add("leaves", "z"),
              ElementsAre("joins: 1 more in the last 61 s, the last: late", "z"));
}

TEST_F(LogLimiterTest, NothingIsLeftUnsaidAtTheEnd) {
  fill("joins");
  add("joins", "x");
  now_ += 2s;
  EXPECT_THAT(rest(), ElementsAre("joins: 1 more in the last 2 s, the last: x"));
  EXPECT_THAT(rest(), IsEmpty());
}

}  // namespace
}  // namespace treeroll
