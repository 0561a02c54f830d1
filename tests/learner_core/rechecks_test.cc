#include "learner/core/rechecks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/protocol/limits.h"
#include "learner/core/run.h"

namespace treeroll::learner {
namespace {

constexpr protocol::RolloutKey kKey{0, 7};

Opinion opinion(protocol::WorkerId worker, double reward, const std::string& numeric_class = "a") {
  return {{.worker_id = worker,
           .numeric_class = numeric_class,
           .host = "host" + std::to_string(worker),
           .pid = 1},
          Outcome::ok(reward)};
}

const RecheckedWorker& tally(const Rechecks& rechecks, protocol::WorkerId worker) {
  return rechecks.record().workers.at(worker);
}

TEST(RechecksTest, TwoThatAgreeSettleARollOut) {
  Rechecks rechecks;
  EXPECT_FALSE(rechecks.open(kKey, opinion(1, .5)));
  EXPECT_TRUE(rechecks.is_open(kKey));
  const Rechecks::News news = rechecks.take(kKey, opinion(2, .5));
  EXPECT_TRUE(news.disagreements.empty());
  EXPECT_FALSE(news.wants_another);
  EXPECT_FALSE(rechecks.is_open(kKey));
  EXPECT_EQ(rechecks.record().num_rechecked, 1);
  EXPECT_EQ(rechecks.record().num_disputed, 0);
  EXPECT_EQ(tally(rechecks, 1).num_compared, 1);
  EXPECT_EQ(tally(rechecks, 2).num_disagreed, 0);
}

TEST(RechecksTest, OfTwoThatDifferByABitAThirdOneTellsWhichIsWrong) {
  Rechecks rechecks;
  rechecks.open(kKey, opinion(1, std::nextafter(.5, 1)));
  Rechecks::News news = rechecks.take(kKey, opinion(2, .5));
  ASSERT_EQ(news.disagreements.size(), 1U);
  EXPECT_EQ(news.disagreements[0].first.worker.worker_id, 1);
  EXPECT_TRUE(news.wants_another);
  EXPECT_TRUE(news.outvoted.empty());
  news = rechecks.take(kKey, opinion(3, .5));
  ASSERT_EQ(news.outvoted.size(), 1U);
  EXPECT_EQ(news.outvoted[0].worker_id, 1);
  EXPECT_FALSE(news.wants_another);
  EXPECT_TRUE(rechecks.is_outvoted(1));
  EXPECT_FALSE(rechecks.is_outvoted(2));
  EXPECT_EQ(tally(rechecks, 1).num_disagreed, 2);
  EXPECT_EQ(tally(rechecks, 3).num_disagreed, 1);
  EXPECT_EQ(rechecks.record().num_disputed, 1);
  EXPECT_EQ(rechecks.record().num_undecided, 0);
}

TEST(RechecksTest, ProcessesOfOneHostHaveOneVote) {
  Rechecks rechecks;
  const auto of_host = [](protocol::WorkerId worker, double reward) {
    Opinion one = opinion(worker, reward);
    one.worker.host = "broken";
    return one;
  };
  rechecks.open(kKey, opinion(1, .5));
  rechecks.take(kKey, of_host(2, .4));
  Rechecks::News news = rechecks.take(kKey, of_host(3, .4));
  EXPECT_TRUE(news.outvoted.empty());
  EXPECT_TRUE(news.wants_another);
  news = rechecks.take(kKey, opinion(4, .5));
  ASSERT_EQ(news.outvoted.size(), 2U) << "both";
  EXPECT_EQ(news.outvoted[0].worker_id, 2);
  EXPECT_EQ(news.outvoted[1].worker_id, 3);
  ASSERT_EQ(news.others.size(), 2U);
  EXPECT_EQ(news.others[0].worker_id, 1);
}

/// Who has stolen one key has names without number, and says of each that it is of another host.
TEST(RechecksTest, NamesOfOneKeyHaveOneVote) {
  constexpr auto kStolen = std::int64_t{7} << protocol::kOwnNameBits;
  Rechecks rechecks;
  rechecks.open(kKey, opinion(1, .5));
  for (const std::int64_t name : {1, 2, 3}) {
    EXPECT_TRUE(rechecks.take(kKey, opinion(kStolen + name, .4)).outvoted.empty());
  }
  EXPECT_EQ(rechecks.take(kKey, opinion(2, .5)).outvoted.size(), 3U);
  EXPECT_FALSE(rechecks.is_outvoted(1));
}

TEST(RechecksTest, FiveThatAllDifferStayUndecided) {
  Rechecks rechecks;
  rechecks.open(kKey, opinion(1, .1));
  for (int worker = 2; worker <= static_cast<int>(protocol::kOpinionsMax); ++worker) {
    const Rechecks::News news = rechecks.take(kKey, opinion(worker, .1 * worker));
    EXPECT_EQ(news.wants_another, worker < static_cast<int>(protocol::kOpinionsMax));
    EXPECT_TRUE(news.outvoted.empty());
  }
  EXPECT_FALSE(rechecks.is_open(kKey));
  EXPECT_EQ(rechecks.record().num_undecided, 1);
}

TEST(RechecksTest, StatusesDifferLikeRewards) {
  Rechecks rechecks;
  rechecks.open(kKey, {{.worker_id = 1, .numeric_class = "a", .host = "", .pid = 0},
                       Outcome::failed(RolloutStatus::kDiverged, "one reason")});
  EXPECT_TRUE(rechecks
                  .take(kKey, {{.worker_id = 2, .numeric_class = "a", .host = "", .pid = 0},
                               Outcome::failed(RolloutStatus::kDiverged, "another")})
                  .disagreements.empty());
  rechecks.open({0, 8}, opinion(1, 0));
  EXPECT_TRUE(rechecks
                  .take({0, 8}, {{.worker_id = 2, .numeric_class = "a", .host = "", .pid = 0},
                                 Outcome::failed(RolloutStatus::kDiverged)})
                  .wants_another);
}

TEST(RechecksTest, BetweenTwoClassesLastBitsAreNoDisagreementAndNobodyIsOutvoted) {
  Rechecks rechecks;
  rechecks.open(kKey, opinion(1, .5, "a"));
  EXPECT_TRUE(rechecks.take(kKey, opinion(2, .5 + 1e-8, "b")).disagreements.empty());
  rechecks.open({0, 8}, opinion(1, .5, "a"));
  const Rechecks::News news = rechecks.take({0, 8}, opinion(2, .51, "b"));
  EXPECT_EQ(news.disagreements.size(), 1U);
  EXPECT_FALSE(news.wants_another) << "which class is right no third worker tells";
  EXPECT_EQ(rechecks.record().num_undecided, 0);
  const RecheckedClasses& classes = rechecks.record().classes.at({"a", "b"});
  EXPECT_EQ(classes.num_compared, 2);
  EXPECT_EQ(classes.num_disagreed, 1);
  EXPECT_NEAR(classes.difference_max, .01, 1e-12);
}

TEST(RechecksTest, OfTwoWithoutAClassNeitherIsOutvoted) {
  Rechecks rechecks;
  rechecks.open(kKey, opinion(1, .1, ""));
  EXPECT_FALSE(rechecks.take(kKey, opinion(2, .2, "")).wants_another);
  EXPECT_FALSE(rechecks.is_outvoted(1));
}

TEST(RechecksTest, TheFirstThatWaitsIsGivenUpForOneTooMany) {
  Rechecks rechecks;
  const int num_max = static_cast<int>(protocol::kRechecksOpenMax);
  for (int number = 0; number < num_max; ++number) {
    EXPECT_FALSE(rechecks.open({0, number}, opinion(1, .5)));
  }
  const auto given_up = rechecks.open({0, num_max}, opinion(1, .5));
  ASSERT_TRUE(given_up);
  EXPECT_EQ(given_up->number, 0);
  EXPECT_FALSE(rechecks.is_open({0, 0}));
  EXPECT_EQ(rechecks.waiting().size(), protocol::kRechecksOpenMax);
}

TEST(RechecksTest, OfMoreWorkersThanMayBeKnownThoseStayThatWereOutvoted) {
  Rechecks rechecks;
  const int num_max = static_cast<int>(protocol::kWorkersMax);
  for (int worker = 0; worker < num_max + 10; worker += 2) {
    rechecks.open({0, worker}, opinion(worker, .5));
    rechecks.take({0, worker}, opinion(worker + 1, .5));
  }
  EXPECT_EQ(rechecks.record().workers.size(), protocol::kWorkersMax);
  EXPECT_EQ(rechecks.record().num_rechecked, num_max / 2 + 5);
  // Names of before do not hide who is outvoted later, and who was stays.
  const auto outvote = [&](int number, protocol::WorkerId liar) {
    rechecks.open({0, number}, opinion(liar, .1));
    rechecks.take({0, number}, opinion(liar + 1, .5));
    rechecks.take({0, number}, opinion(liar + 2, .5));
  };
  outvote(num_max + 10, 2 * num_max);
  for (int i = 11; i < 20; ++i) outvote(num_max + i, (i - 8) * num_max);
  for (int i = 2; i < 12; ++i) EXPECT_TRUE(rechecks.is_outvoted(i * num_max)) << i;
  EXPECT_EQ(rechecks.record().workers.size(), protocol::kWorkersMax);
}

TEST(RechecksTest, WhichRollOutsAreRunAgainFollowsFromTheSeedAlone) {
  Study study;
  study.seed = 3;
  study.recheck = .02;
  int num_drawn = 0;
  for (int number = 0; number < 10'000; ++number) {
    num_drawn += is_rechecked(study, 1, number);
  }
  EXPECT_NEAR(num_drawn, 200, 60);
  Study more = study;
  more.recheck = .5;
  Study other = study;
  other.seed = 4;
  int num_others = 0;
  for (int number = 0; number < 10'000; ++number) {
    if (is_rechecked(study, 1, number)) {
      EXPECT_TRUE(is_rechecked(more, 1, number)) << "a larger share has the smaller one";
    }
    num_others += is_rechecked(study, 1, number) && is_rechecked(other, 1, number);
  }
  EXPECT_LT(num_others, 30);
  study.recheck = 0;
  EXPECT_FALSE(is_rechecked(study, 0, 0));
  study.recheck = 1;
  EXPECT_TRUE(is_rechecked(study, 0, Run::kFinal));
}

}  // namespace
}  // namespace treeroll::learner
