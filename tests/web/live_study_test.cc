#include "learner/web/views/live_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/policy/policy_bounds.h"
#include "learner/web/views/views.h"
#include "tests/web/fed_study.h"

namespace treeroll::web {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

json state_of(const FedStudy& study) { return json::parse(state_view(*study.live, study.now)); }

TEST(LiveStudyTest, CurvesAreThoseOfTheRecordsEachResultOnce) {
  FedStudy study(learner::small_study(30, 5));
  study.answer(100);
  const json curves = json::parse(curves_view(*study.live))["conditions"][0];
  ASSERT_EQ(curves["mean"].size(), 30U);
  for (std::size_t number = 0; number < 30; ++number) {
    std::vector<double> rewards;
    double bests = 0;
    for (const RunRecord& run : study.core->run_records()) {
      if (number >= run.rollouts.size()) continue;
      rewards.push_back(run.rollouts[number].reward);
      double best = 0;
      for (std::size_t i = 0; i <= number; ++i) best = std::max(best, run.rollouts[i].reward);
      bests += best;
    }
    if (rewards.empty()) {
      EXPECT_TRUE(curves["mean"][number].is_null());
      continue;
    }
    double mean = 0;
    for (const double reward : rewards) mean += reward / static_cast<double>(rewards.size());
    EXPECT_EQ(curves["runs"][number], static_cast<double>(rewards.size()));
    EXPECT_NEAR(curves["mean"][number], mean, 1e-4);
    EXPECT_NEAR(curves["best"][number], bests / static_cast<double>(rewards.size()), 1e-4);
    EXPECT_NEAR(curves["median"][number], quantile(rewards, .5), 1e-4);
  }
}

TEST(LiveStudyTest, AViewChangesNothing) {
  FedStudy study(learner::small_study(30, 2));
  study.answer(41);
  study.tick();
  const std::string curves = curves_view(*study.live);
  const std::string state = state_view(*study.live, study.now);
  EXPECT_EQ(curves_view(*study.live), curves);
  EXPECT_EQ(state_view(*study.live, study.now), state);
}

TEST(LiveStudyTest, TenThousandRolloutsOfManyRunsStaySmall) {
  FedStudy study(learner::small_study(10'000, 4));
  study.answer(4 * 10'002);
  EXPECT_EQ(study.core->outcome(), learner::LearnerCore::Outcome::kDone);
  const json curves = json::parse(curves_view(*study.live))["conditions"][0];
  EXPECT_LE(curves["mean"].size(), 600U);
  EXPECT_EQ(curves["rollouts_per_point"], 17);
  const json run = json::parse(run_view(*study.live, 3));
  EXPECT_LE(run["rewards"]["mean"].size(), 600U);
  EXPECT_LT(curves_view(*study.live).size(), 60'000U);
  EXPECT_LT(state_view(*study.live, study.now).size(), 10'000U);
}

TEST(LiveStudyTest, SaysHowFarItIsAndHowFast) {
  FedStudy study(learner::small_study(30, 2));
  study.tick();
  study.answer(20);
  study.tick();
  const json state = state_of(study);
  EXPECT_EQ(state["ledger"]["applied"].get<int>() + state["evaluated"].get<int>(), 20);
  EXPECT_EQ(state["rollouts"], 60);
  EXPECT_EQ(state["rates"], json({20.}));
  EXPECT_EQ(state["stage"], "learning");
  EXPECT_EQ(state["conditions"][0]["name"], "flat");
  const json best = state["conditions"][0]["best"];
  const learner::Run& run = study.core->runs()[best["run"].get<std::size_t>()];
  EXPECT_EQ(best["reward"], run.exploration().best().reward);
  EXPECT_EQ(best["rollout"], run.exploration().best().rollout);
}

TEST(LiveStudyTest, FailuresAreCountedByReasonAndTheLastAreKept) {
  FedStudy study(learner::small_study(500, 2));
  study.answer(1000, [](protocol::RolloutKey key, const Eigen::VectorXd& theta) {
    if (key.number % 3 != 0) return FedStudy::by_bump(key, theta);
    return Outcome::failed(RolloutStatus::kDiverged, "<b>the \"arm\"</b> & \xff\xfe");
  });
  study.tick();
  const json state = state_of(study);
  EXPECT_GT(state["num_failures"], 300);
  EXPECT_EQ(state["reasons"][0]["count"], state["num_failures"]);
  EXPECT_EQ(state["failures"].size(), 60U);
  EXPECT_EQ(state["failures"][0]["count"], state["num_failures"]);
  EXPECT_EQ(study.live->failures().size(), LiveStudy::kFailuresMax);
}

TEST(LiveStudyTest, WhatStrangersMakeUpIsBounded) {
  FedStudy study(learner::small_study(4000, 1));
  int count = 0;
  study.answer(4000, [&count](protocol::RolloutKey, const Eigen::VectorXd&) {
    return Outcome::failed(RolloutStatus::kFailed, "reason " + std::to_string(++count));
  });
  EXPECT_LE(study.live->reasons().size(), LiveStudy::kReasonsMax + 1);
  EXPECT_GT(study.live->reasons().at(""), 3000);
  for (protocol::WorkerId id = 1; id < 10'000; ++id) {
    protocol::WorkerStatus status;
    status.worker_id = id;
    study.live->heard(status, FedStudy::kLearner);  // the core has never heard it
  }
  EXPECT_LE(study.live->workers().size(), 1U);
}

/// Each start of a worker's process is another one, and a journal has them all.
TEST(LiveStudyTest, WorkersThatAreGoneMakeRoomWhoHasAnsweredLeastFirst) {
  FedStudy study(learner::small_study(4000, 1));
  protocol::WorkerId next = 1000;
  const auto have_been = [&](std::size_t count, bool answered) {
    for (std::size_t i = 0; i < count; ++i, ++next) {
      study.live->accepted(KnownWorker{next, "class", "array", 1});
      if (answered) {
        AcceptedResult result;
        result.outcome = Outcome::ok(1);
        result.worker_id = next;
        study.live->accepted(result);
      }
    }
  };
  have_been(2 * LiveStudy::kWorkersMax, false);
  EXPECT_LE(study.live->workers().size(), LiveStudy::kWorkersMax);
  study.answer(10);  // by worker 9, which comes after them
  have_been(3 * LiveStudy::kWorkersMax, true);
  EXPECT_LE(study.live->workers().size(), LiveStudy::kWorkersMax);
  ASSERT_TRUE(study.live->workers().contains(9)) << "it has answered more than they";
  EXPECT_EQ(study.live->workers().at(9).num_accepted, 10);
  EXPECT_TRUE(study.live->workers().contains(next - 1));
}

TEST(LiveStudyTest, AWorkerIsShownWithWhatIsWrongWithIt) {
  FedStudy study(learner::small_study(30, 2));
  protocol::WorkerStatus status;
  status.worker_id = (std::int64_t{1} << 62) + 1;  // more than a browser's numbers hold
  status.host = "lab7";
  status.pid = 12;
  status.num_evaluators = 4;
  status.receive_buffer_bytes = 1 << 20;
  status.draining = true;
  study.hear(status);
  study.tick();
  const json worker = state_of(study)["workers"][0];
  EXPECT_EQ(worker["id"], "4611686018427387905");
  EXPECT_EQ(worker["host"], "lab7");
  EXPECT_EQ(worker["evaluators"], 4);
  EXPECT_THAT(worker["trouble"].get<std::string>(), HasSubstr("silent"));
}

TEST(LiveStudyTest, OfAWorkerThatIsOutvotedIsSaidWhyItGetsNothing) {
  Study checked = learner::small_study(30, 2);
  checked.recheck = 1;
  learner::Cluster cluster(checked);
  for (int id = 1; id <= 4; ++id) cluster.add_worker(id).host = "host" + std::to_string(id);
  cluster.workers[2]->reward_factor = .5;
  const LiveStudy live(*cluster.core, {});
  cluster.start();
  json of_liar;
  cluster.run(std::chrono::hours(1), [&] {
    if (!of_liar.is_null() || !cluster.core->workforce().workers().all().at(3).distrusted) return;
    of_liar = json::parse(state_view(live, cluster.now))["workers"];
  });
  ASSERT_EQ(of_liar.size(), 4U);
  for (const json& worker : of_liar) {
    EXPECT_EQ(worker["trouble"],
              worker["id"] == "3" ? "two others contradict its answers: it gets nothing for a while"
                                  : "");
  }
}

/// What only workers know comes while the page is shown.
TEST(LiveStudyTest, NamesOfSignalsAreShownOnceAWorkerHasToldThem) {
  learner::Cluster cluster(learner::small_study(30, 2), /*knows_task=*/false);
  cluster.add_worker(1).description = report_text(
      {.input_dim = 1, .output_dim = 1, .time_limit_s = 10, .signals = {{"time_s"}, {"force_n"}}});
  StudyFacts facts;
  facts.columns = {{"t", "x"}};
  const LiveStudy live(*cluster.core, facts);
  cluster.start();
  EXPECT_EQ(json::parse(condition_view(live, 0))["columns"], json({"t", "x"}));
  cluster.run(std::chrono::hours(1));
  EXPECT_EQ(json::parse(condition_view(live, 0))["columns"], json({"time_s", "force_n"}));
}

TEST(LiveStudyTest, AFinalPolicyIsWorthTheMeanOfItsEvaluations) {
  Study several = learner::small_study(30, 1);
  several.final_evaluations = 4;
  FedStudy study(several);
  const auto final_of = [&] { return json::parse(run_view(*study.live, 0))["final"]; };
  study.answer(31);
  EXPECT_TRUE(final_of().is_null());
  const auto answering = [](protocol::RolloutKey key, const Eigen::VectorXd&) {
    if (key.number == learner::Run::final_number(1)) {
      return Outcome::failed(RolloutStatus::kDiverged, "it fell");
    }
    return Outcome::ok(key.number == learner::Run::kFinal ? .9 : .3);
  };
  study.answer(1, answering);
  EXPECT_EQ(final_of()["evaluations"], 1);
  study.answer(3, answering);
  const json said = final_of();
  EXPECT_DOUBLE_EQ(said["reward"], (.9 + 0 + .3 + .3) / 4);
  EXPECT_EQ(said["evaluations"], 4);
  EXPECT_EQ(said["wanted"], 4);
  EXPECT_EQ(said["failed"], 1);
  EXPECT_EQ(said["reason"], "it fell");
  EXPECT_EQ(said["reward"], study.core->run_records()[0].final_reward.value());
}

TEST(LiveStudyTest, ARunIsShownWithItsPolicyAndItsNoise) {
  FedStudy study(learner::small_study(30, 2));
  study.answer(25);
  const json run = json::parse(run_view(*study.live, 1));
  EXPECT_EQ(run["run"], 1);
  EXPECT_EQ(run["rewards"]["mean"].size(), study.core->runs()[1].rollouts().size());
  const json& now = run["now"];
  EXPECT_EQ(now["theta_dim"], 4);
  EXPECT_EQ(now["deviations"].size(), 4U);
  ASSERT_EQ(now["policy"]["layers"].size(), 1U);
  EXPECT_EQ(now["policy"]["layers"][0]["gaussians"].size(), 2U);
  EXPECT_EQ(now["policy"]["layers"][0]["outputs"][0].size(),
            now["policy"]["layers"][0]["inputs"].size());
  EXPECT_EQ(now["noise"]["draws"].size(), 12U);
}

TEST(LiveStudyTest, ARunWhosePolicyHasBoundsIsShownAsAnyOther) {
  Study small = learner::small_study(30, 2);
  // Most draws are beyond them, and nearly all change faster between two points of a curve.
  for (Condition& condition : small.conditions) {
    condition.start = bounded(condition.start, {.refuses = true,
                                                .output_min = {-1e-3},
                                                .output_max = {1e-3},
                                                .output_rate_max = {1e-6},
                                                .sample_time_s = .01});
  }
  FedStudy study(std::move(small));
  study.answer(25);
  const json now = json::parse(run_view(*study.live, 1))["now"];
  ASSERT_EQ(now["noise"]["draws"].size(), 12U);
  for (const json& draw : now["noise"]["draws"]) {
    EXPECT_EQ(draw[0].size(), now["noise"]["inputs"].size());
  }
}

TEST(LiveStudyTest, RunsComeInTheOrderThatIsAskedFor) {
  FedStudy study(learner::small_study(10, 120));
  study.answer(1200);
  const json best = json::parse(runs_view(*study.live, {.condition = 0, .order = "best"}));
  EXPECT_EQ(best["num"], 120);
  ASSERT_EQ(best["runs"].size(), 50U);
  for (std::size_t i = 1; i < 50; ++i)
    EXPECT_GE(best["runs"][i - 1]["best"], best["runs"][i]["best"]);
  EXPECT_EQ(json::parse(runs_view(*study.live, {.condition = {}, .from = 100}))["runs"].size(),
            20U);
  EXPECT_EQ(json::parse(runs_view(*study.live, {.condition = {}, .from = 500}))["runs"].size(), 0U);
}

TEST(LiveStudyTest, RolloutsAreFilteredAndGoOnWhereAPageEnded) {
  FedStudy study(learner::small_study(300, 3));
  study.answer(10'000, [](protocol::RolloutKey key, const Eigen::VectorXd& theta) {
    if (key.number % 50 == 7) return Outcome::failed(RolloutStatus::kCrashed, "burst");
    return FedStudy::by_bump(key, theta);
  });
  RolloutsQuery query;
  query.status = "failed";
  query.order = "number";
  const json failed = json::parse(rollouts_view(*study.live, query));
  EXPECT_EQ(failed["rollouts"].size(), 18U);
  EXPECT_TRUE(failed["next"].is_null());
  EXPECT_EQ(failed["rollouts"][0]["reason"], "burst");

  query.status = "";
  std::size_t count = 0;
  for (int page = 0; page < 9; ++page) {
    const json part = json::parse(rollouts_view(*study.live, query));
    count += part["rollouts"].size();
    EXPECT_EQ(part["next"].is_null(), page == 8);
    if (!part["next"].is_null()) query.from = part["next"];
  }
  EXPECT_EQ(count, 900U);
  query.from = "nonsense";
  EXPECT_EQ(json::parse(rollouts_view(*study.live, query))["rollouts"][0]["run"], 0);
  query.order = "newest";
  EXPECT_EQ(json::parse(rollouts_view(*study.live, query))["rollouts"][0]["rollout"], 299);
}

TEST(LiveStudyTest, NewestFirstSaysThatItLooksAtTheLastOnesAlone) {
  FedStudy study(learner::small_study(600, 2));
  const RolloutsQuery query;
  study.answer(150);
  json view = json::parse(rollouts_view(*study.live, query));
  EXPECT_TRUE(view["last"].is_null());
  EXPECT_EQ(view["is_cut"], true);
  study.answer(10'000);
  view = json::parse(rollouts_view(*study.live, query));
  EXPECT_EQ(view["last"], LiveStudy::kRecentMax);
  EXPECT_EQ(view["is_cut"], true);
  RolloutsQuery of_number = query;
  of_number.order = "number";
  view = json::parse(rollouts_view(*study.live, of_number));
  EXPECT_TRUE(view["last"].is_null());
  EXPECT_EQ(view["is_cut"], false);
}

TEST(LiveStudyTest, MetricsAreEscapedAndEachNameIsExplainedOnce) {
  Study small = learner::small_study(30, 2);
  small.name = "a\"b\\c";
  FedStudy study(std::move(small));
  study.answer(10);
  study.tick();
  const std::string text = metrics_view(*study.live, study.now);
  EXPECT_THAT(text, HasSubstr("treeroll_rollouts_budget{study=\"a\\\"b\\\\c\"} 60\n"));
  EXPECT_THAT(text, HasSubstr("treeroll_condition_rollouts_applied_total{study=\"a\\\"b\\\\c\","
                              "condition=\"flat\"} 8\n"));
  std::map<std::string, int> explained;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# HELP ")) ++explained[line.substr(7, line.find(' ', 7) - 7)];
  }
  EXPECT_GT(explained.size(), 20U);
  for (const auto& [name, count] : explained) EXPECT_EQ(count, 1) << name;
}

}  // namespace
}  // namespace treeroll::web
