#include "learner/top/group_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace treeroll::top {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

constexpr TimePoint kStart{seconds(100)};

protocol::LearnerStatus learner(protocol::LearnerId id, std::int64_t applied = 626) {
  protocol::LearnerStatus status;
  status.learner_id = id;
  status.host = "lab1";
  status.pid = 42;
  status.study = "study_" + std::to_string(id);
  status.num_runs = 8;
  status.num_rollouts = 4800;
  status.num_evaluations = 16;
  status.num_applied = applied;
  status.num_evaluators = 2;
  status.best_reward = .978;
  return status;
}

protocol::RunStatus run(protocol::LearnerId id, int number, double best) {
  protocol::RunStatus status;
  status.learner_id = id;
  status.run = number;
  status.condition = "condition_" + std::to_string(number);
  status.num_rollouts = 600;
  status.best_reward = best;
  return status;
}

std::string text_of(const GroupView& view, const Choice& choice = {}, TimePoint now = kStart) {
  return plain_text(view.lines(choice, 200, 60, now));
}

TEST(GroupViewTest, SaysThatNobodyIsHeard) {
  EXPECT_THAT(text_of({}), HasSubstr("no learner is heard"));
}

TEST(GroupViewTest, ShowsHowFarALearnerIsAndHowFast) {
  GroupView view;
  for (int second = 0; second < 10; ++second) {
    view.hear(learner(1, 100 * second), kStart + seconds(second));
  }
  const std::string text = text_of(view, {}, kStart + seconds(9));
  EXPECT_THAT(text, HasSubstr("study_1 learner on lab1 pid 42"));
  EXPECT_THAT(text, HasSubstr("roll-outs 900 of 4816"));
  EXPECT_THAT(text, HasSubstr("best 0.978"));
  EXPECT_THAT(text, HasSubstr("pace 100/s  left 39 s"));
  EXPECT_THAT(text, Not(HasSubstr("silent")));
  EXPECT_THAT(text_of(view, {}, kStart + seconds(20)), HasSubstr("silent for 11 s"));
}

TEST(GroupViewTest, OrdersRunsAndScrollsThem) {
  GroupView view;
  view.hear(learner(1), kStart);
  for (int number = 0; number < 30; ++number) view.hear(run(1, number, .01 * number), kStart);
  EXPECT_EQ(view.num_runs({}, kStart), 30U);
  const auto place = [](const std::string& text, int number) {
    return text.find("condition_" + std::to_string(number) + " ");
  };
  EXPECT_LT(place(text_of(view), 3), place(text_of(view), 4));
  const std::string best = text_of(view, {.order = RunOrder::kBest});
  EXPECT_GT(place(best, 3), place(best, 4));
  const std::string scrolled = text_of(view, {.from = 5});
  EXPECT_EQ(place(scrolled, 4), std::string::npos);
  EXPECT_NE(place(scrolled, 5), std::string::npos);
  EXPECT_NE(place(text_of(view, {.from = 1000}), 29), std::string::npos);
}

TEST(GroupViewTest, LearnersOfOneGroupAreShownOneByOne) {
  GroupView view;
  view.hear(learner(1), kStart);
  view.hear(learner(2), kStart);
  view.hear(run(2, 7, .5), kStart);
  EXPECT_THAT(text_of(view), HasSubstr("study_1"));
  EXPECT_THAT(text_of(view), Not(HasSubstr("condition_7")));
  EXPECT_EQ(view.next_learner({}, kStart), 2);
  EXPECT_THAT(text_of(view, {.learner = 2}), HasSubstr("condition_7"));
  EXPECT_EQ(view.next_learner({.learner = 2}, kStart), 1);
}

TEST(GroupViewTest, WhoPrintsOnceHasEveryLearnerWithItsRuns) {
  GroupView view;
  for (const int id : {1, 2}) {
    view.hear(learner(id), kStart);
    view.hear(run(id, 6 + id, .5), kStart);
  }
  const std::string text = plain_text(view.lines_of_all(200, 60, kStart));
  for (const char* words : {"study_1 learner", "study_2 learner", "condition_7", "condition_8"}) {
    EXPECT_THAT(text, HasSubstr(words));
  }
  EXPECT_LT(text.find("condition_7"), text.find("study_2 on lab1"));
  EXPECT_LT(text.find("study_2 on lab1"), text.find("condition_8"));
  EXPECT_THAT(text, Not(HasSubstr("Tab")));
}

/// As after a crash and --resume: ids are random, so the dead one may have the lower one.
TEST(GroupViewTest, WhoSpeaksIsShownBeforeWhoIsSilentUnlessThatOneIsChosen) {
  GroupView view;
  view.hear(learner(1), kStart);
  view.hear(learner(2), kStart + seconds(9));
  const TimePoint now = kStart + seconds(10);
  EXPECT_THAT(text_of(view, {}, now), HasSubstr("study_2"));
  EXPECT_THAT(text_of(view, {}, now), HasSubstr("learner 1 of 2"));
  const std::string all = plain_text(view.lines_of_all(200, 60, now));
  EXPECT_LT(all.find("study_2"), all.find("study_1"));
  EXPECT_EQ(view.next_learner({}, now), 1);
  EXPECT_THAT(text_of(view, {.learner = 1}, now), HasSubstr("silent for 10 s"));
}

TEST(GroupViewTest, ShowsWorkersAndWhatIsWrong) {
  GroupView view;
  protocol::LearnerStatus status = learner(1);
  status.waiting_for = "no workers";
  status.last_failure = "run 0, roll-out 7: diverged";
  view.hear(status, kStart);
  protocol::WorkerStatus worker;
  worker.worker_id = 5;
  worker.host = "lab9";
  worker.num_evaluators = 16;
  worker.held.push_back({.learner_id = 1, .keys = {{0, 1}, {0, 2}}});
  worker.draining = true;
  view.hear(worker, kStart);
  const std::string text = text_of(view);
  EXPECT_THAT(text, HasSubstr("waiting: no workers"));
  EXPECT_THAT(text, HasSubstr("last failure: run 0, roll-out 7: diverged"));
  EXPECT_THAT(text, HasSubstr("lab9"));
  EXPECT_THAT(text, HasSubstr("drains"));
}

/// On a screen of 80 x 24.
void expect_plain(const std::vector<Line>& lines) {
  EXPECT_LE(lines.size(), 24U);
  for (const Line& line : lines) {
    std::size_t width = 0;
    for (const Span& span : line) {
      width += span.text.size();
      for (const unsigned char byte : span.text) EXPECT_TRUE(byte >= 0x20 && byte < 0x7f);
    }
    EXPECT_LE(width, 80U);
  }
}

TEST(GroupViewTest, WhatStrangersSayMovesNoCursorAndIsBounded) {
  GroupView view;
  protocol::LearnerStatus status = learner(1);
  status.study = "\x1b[2J\x07tab\there\n\xc3\xa4";
  status.waiting_for = std::string(3000, 'x');
  view.hear(status, kStart);
  expect_plain(view.lines({}, 80, 24, kStart));
  for (int id = 2; id < 200; ++id) view.hear(learner(id), kStart + seconds(id));
  for (int id = 1; id < 5000; ++id) {
    protocol::WorkerStatus worker;
    worker.worker_id = id;
    worker.host = std::string(1, '\x1b');
    view.hear(worker, kStart);
    view.hear(run(12'345, id, .5), kStart);  // of nobody who has spoken
  }
  EXPECT_EQ(view.num_learners(), GroupView::kLearnersMax);
  EXPECT_EQ(view.num_workers(), GroupView::kWorkersMax);
  expect_plain(view.lines({}, 80, 24, kStart));
}

TEST(GroupViewTest, WhoHasBeenSilentForLongIsForgotten) {
  GroupView view;
  view.hear(learner(1), kStart);
  view.forget_silent(kStart + minutes(9));
  EXPECT_EQ(view.num_learners(), 1U);
  view.forget_silent(kStart + minutes(11));
  EXPECT_EQ(view.num_learners(), 0U);
}

TEST(GroupViewTest, NumbersThatAreNoneBreakNothing) {
  GroupView view;
  protocol::LearnerStatus status = learner(1);
  status.num_rollouts = 0;
  status.num_evaluations = 0;
  view.hear(status, kStart);
  protocol::RunStatus strange = run(1, 0, 1e300);
  strange.num_applied = -5;
  strange.num_rollouts = 0;
  view.hear(strange, kStart);
  for (const std::size_t size : {0U, 1U, 7U}) {
    for (const Line& line : view.lines({}, size, size, kStart)) {
      std::size_t width = 0;
      for (const Span& span : line) width += span.text.size();
      EXPECT_LE(width, size);
    }
  }
}

}  // namespace
}  // namespace treeroll::top
