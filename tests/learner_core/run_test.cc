// What a run evaluates outside of its budget, and what becomes of trials that are void.
#include "learner/core/run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/policy/policy_registry.h"
#include "learner/results/run_counts.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

double reward_of(const Eigen::VectorXd& theta) {
  return bump({theta.data(), theta.data() + theta.size()});
}

std::vector<int> numbers(const std::vector<explore::Draw>& draws) {
  std::vector<int> found;
  for (const explore::Draw& draw : draws) found.push_back(draw.rollout);
  return found;
}

/// Ends a run by itself. @param outcome  of a draw; asked again while it is discarded
template <class OutcomeOf>
RunRecord finish(learner::Run& run, OutcomeOf outcome) {
  while (!run.done()) {
    const std::vector<explore::Draw> draws = run.take_draws();
    EXPECT_THAT(draws, testing::Not(IsEmpty()));
    for (const explore::Draw& draw : draws) run.accept(draw.rollout, outcome(run, draw), 0);
  }
  return run.record();
}

TEST(RunTest, TheStartPolicyIsEvaluatedOnceBeforeAnythingIsLearnt) {
  const Study study = small_study(20, 1);
  learner::Run run(study, 0);
  const std::vector<explore::Draw> first = run.take_draws();
  EXPECT_THAT(numbers(first), ElementsAre(learner::Run::kStart, 0));
  EXPECT_EQ(first[0].theta, study.conditions[0].start->theta());
  EXPECT_NE(first[1].theta, first[0].theta);
  run.accept(learner::Run::kStart, Outcome::ok(.25), 0);
  EXPECT_EQ(run.exploration().num_told(), 0) << "it costs no budget";
  run.accept(0, Outcome::ok(reward_of(first[1].theta)), 0);
  const RunRecord record = finish(run, [](const learner::Run&, const explore::Draw& draw) {
    return Outcome::ok(reward_of(draw.theta));
  });
  EXPECT_EQ(record.start, Outcome::ok(.25));
  EXPECT_EQ(record.rollouts.size(), 20U);
}

TEST(RunTest, TheFinalPolicyIsEvaluatedAsOftenAsTheStudySaysWithSeedsOfTheirOwn) {
  Study study = small_study(20, 2);
  study.final_evaluations = 4;
  std::set<std::int64_t> seeds;
  std::set<double> rewards;
  learner::Run run(study, 1);
  int number = 0;
  const RunRecord record = finish(run, [&](const learner::Run& self, const explore::Draw& draw) {
    if (draw.rollout >= 0) return Outcome::ok(reward_of(draw.theta));
    seeds.insert(task_seed(study, self.repetition(), draw.rollout, 0));
    if (draw.rollout == learner::Run::kStart) return Outcome::ok(.5);
    rewards.insert(reward_of(draw.theta));
    return ++number == 2 ? Outcome::failed(RolloutStatus::kDiverged) : Outcome::ok(.2 * number);
  });
  EXPECT_EQ(seeds.size(), 5U);
  EXPECT_EQ(rewards.size(), 1U) << "one policy";
  ASSERT_EQ(record.finals.size(), 4U);
  EXPECT_DOUBLE_EQ(*record.final_reward, (.2 + 0 + .6 + .8) / 4) << "a failure counts as 0";
}

TEST(RunTest, TheFinalMeanPolicyIsKeptBesideTheBestOne) {
  const Study study = small_study(20, 1);
  learner::Run run(study, 0);
  double final_reward = 0;
  const RunRecord record = finish(run, [&](const learner::Run&, const explore::Draw& draw) {
    if (draw.rollout == learner::Run::kFinal) final_reward = reward_of(draw.theta);
    return Outcome::ok(reward_of(draw.theta));
  });
  EXPECT_NE(record.final_policy, record.best_policy);
  EXPECT_EQ(record.final_policy,
            to_json(*study.conditions[0].start->with(run.exploration().mean())));
  EXPECT_EQ(*record.final_reward, final_reward);
  // Where every roll-out has failed it is the only one that means something.
  learner::Run failing(study, 0);
  const RunRecord failed = finish(failing, [](const learner::Run&, const explore::Draw&) {
    return Outcome::failed(RolloutStatus::kFailed, "no robot");
  });
  EXPECT_EQ(failed.final_policy, to_json(*study.conditions[0].start));
}

TEST(RunTest, FailuresKeepTheirReasonsEachOnce) {
  const Study study = small_study(12, 1);
  learner::Run run(study, 0);
  const RunRecord record = finish(run, [](const learner::Run&, const explore::Draw& draw) {
    if (draw.rollout % 3 == 1) return Outcome::failed(RolloutStatus::kDiverged, "too fast");
    if (draw.rollout % 3 == 2) return Outcome::failed(RolloutStatus::kFailed, "too far");
    return Outcome::ok(.5);
  });
  EXPECT_THAT(record.reasons, ElementsAre("too fast", "too far"));
  EXPECT_EQ(reason_of(record, record.rollouts[10]), "too fast");
  EXPECT_EQ(reason_of(record, record.rollouts[9]), "");
  EXPECT_EQ(last_failure(record), "roll-out 11: failed: too far");
}

/// A run in which some trials are void learns what it learns without them.
TEST(RunTest, ADiscardedTrialIsMadeAgainWithTheSameThetaAndCostsNothing) {
  Study study = small_study(30, 1, 3);
  for (const bool in_sequence : {true, false}) {
    study.in_sequence = in_sequence;
    learner::Run calm(study, 0);
    const RunRecord without = finish(calm, [](const learner::Run&, const explore::Draw& draw) {
      return Outcome::ok(reward_of(draw.theta));
    });
    learner::Run run(study, 0);
    std::map<int, Eigen::VectorXd> thetas;
    std::map<int, std::set<std::int64_t>> seeds;
    const RunRecord with = finish(run, [&](const learner::Run& self, const explore::Draw& draw) {
      const auto [place, is_new] = thetas.emplace(draw.rollout, draw.theta);
      EXPECT_EQ(place->second, draw.theta);
      const int trial = self.num_discards(draw.rollout);
      EXPECT_TRUE(seeds[draw.rollout].insert(task_seed(study, 0, draw.rollout, trial)).second)
          << "a task whose seed discards a trial would do so for ever";
      const bool discards = trial < (draw.rollout + 4) % 3;
      return discards ? Outcome::discarded("void") : Outcome::ok(reward_of(draw.theta));
    });
    EXPECT_EQ(with.num_discarded, 32) << "the start's and the final policy's among them";
    EXPECT_EQ(with.rollouts.size(), 30U);
    EXPECT_EQ(num_failed(with), 0);
    if (!in_sequence) continue;  // there the order of arrival counts, which they change
    for (std::size_t i = 0; i < 30; ++i) {
      EXPECT_EQ(with.rollouts[i].reward, without.rollouts[i].reward) << i;
    }
    EXPECT_EQ(with.final_policy, without.final_policy);
  }
}

TEST(RunTest, OneDiscardTooManyEndsTheRunAfterWhatIsUnderWay) {
  Study study = small_study(30, 1, 3);
  study.discards_max = 2;
  learner::Run run(study, 0);
  const RunRecord record = finish(run, [](const learner::Run&, const explore::Draw& draw) {
    return draw.rollout == 10 ? Outcome::discarded("caught") : Outcome::ok(reward_of(draw.theta));
  });
  EXPECT_EQ(record.num_discarded, 2);
  EXPECT_EQ(record.rollouts[10].status, RolloutStatus::kDiscarded);
  EXPECT_EQ(record.rollouts.size(), 13U) << "those that were in flight";
  EXPECT_EQ(last_failure(record), "roll-out 10: discarded: caught");
  EXPECT_TRUE(record.final_reward.has_value());
}

/// An operator who goes home for a weekend finds the study where it was.
TEST(RunTest, NobodysAnswerEndsNoRun) {
  Study study = small_study(30, 1, 3);
  for (const int discards_max : {0, 2}) {
    study.discards_max = discards_max;
    learner::Run run(study, 0);
    std::map<int, int> num_trials;
    const RunRecord record = finish(run, [&](const learner::Run& self, const explore::Draw& draw) {
      const int trial = num_trials[draw.rollout]++;
      EXPECT_EQ(self.num_discards(draw.rollout), trial) << "each trial has a seed of its own";
      const bool is_away = draw.rollout == 10 || draw.rollout == learner::Run::kFinal;
      if (is_away && trial < 60) return Outcome::discarded("nobody answered: the terminal is gone");
      if (is_away && trial < 60 + discards_max) return Outcome::discarded("operator");
      return Outcome::ok(reward_of(draw.theta));
    });
    EXPECT_EQ(record.rollouts.size(), 30U);
    EXPECT_EQ(record.num_discarded, 2 * (60 + discards_max));
    EXPECT_TRUE(record.rollouts[10].status == RolloutStatus::kOk);
    EXPECT_TRUE(record.final_reward.has_value());
  }
}

TEST(RunTest, AnEvaluationThatIsAlwaysDiscardedHasNoReward) {
  Study study = small_study(5, 1);
  study.discards_max = 0;
  learner::Run run(study, 0);
  const RunRecord record = finish(run, [](const learner::Run&, const explore::Draw& draw) {
    return draw.rollout < 0 ? Outcome::discarded() : Outcome::ok(.5);
  });
  EXPECT_TRUE(record.start->is_discarded());
  EXPECT_EQ(record.final_reward, std::nullopt);
  EXPECT_EQ(record.rollouts.size(), 5U);
}

}  // namespace
}  // namespace treeroll::learner
