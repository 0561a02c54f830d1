// What only workers know of a task: what they say it is, and what they call its signals.
#include <gmock/gmock.h>

#include "learner/core/task_accounts.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTask = R"({"name":"bump","settings":{}})";
const ContentHash kTaskId = content_hash(kTask);
const SignalNames kNames{{"time_s"}, {"force_n"}};
const SignalNames kOtherNames{{"time_s"}, {"torque_nm"}};

std::string naming(const SignalNames& names) {
  return report_text({.input_dim = 1, .output_dim = 1, .time_limit_s = 10, .signals = names});
}

auto names_the_signals_otherwise() {
  return Contains(Field(&LogLine::text, HasSubstr("outputs are torque_nm, this study calls them "
                                                  "force_n")));
}

class TaskSignalsTest : public ::testing::Test {
 protected:
  FakeWorker& add_worker(protocol::WorkerId id, const SignalNames& names,
                         Duration duration = milliseconds(10)) {
    FakeWorker& worker = cluster_.add_worker(id, duration);
    worker.description = naming(names);
    return worker;
  }
  /// To the end, from the start.
  void learn() {
    cluster_.start();
    cluster_.run(seconds(1000));
    ASSERT_EQ(cluster_.core->outcome(), LearnerCore::Outcome::kDone);
  }
  /// What its policies call them.
  SignalNames names() const { return cluster_.core->study().conditions[0].signals; }
  int num_answered_by(protocol::WorkerId id) const {
    return static_cast<int>(std::ranges::count(cluster_.journal, id, &AcceptedResult::worker_id));
  }
  /// What is learnt is the same whoever names what.
  void expect_rewards_as_without_names() const {
    Cluster plain(small_study(20, 1));
    plain.add_worker(1);
    plain.start();
    plain.run(seconds(1000));
    const RunRecord expected = plain.core->run_records()[0];
    const RunRecord found = cluster_.core->run_records()[0];
    EXPECT_EQ(found.best_reward, expected.best_reward);
    EXPECT_EQ(found.final_reward, expected.final_reward);
  }

  Cluster cluster_{small_study(20, 1), /*knows_task=*/false};
};

TEST_F(TaskSignalsTest, GoFromTheWorkerToThePoliciesAndTheJournal) {
  add_worker(1, kNames);
  learn();
  EXPECT_EQ(names(), kNames);
  const RunRecord run = cluster_.core->run_records()[0];
  for (const std::string& policy : {run.best_policy, run.final_policy}) {
    EXPECT_THAT(policy, HasSubstr(R"("signals":{"inputs":["time_s"],"outputs":["force_n"]})"));
  }
  ASSERT_EQ(cluster_.signals.size(), 1U) << "once";
  EXPECT_EQ(cluster_.signals[0].first, 0U) << "before the first result";
  EXPECT_EQ(cluster_.signals[0].second, (TaskSignals{kTaskId, kNames}));
  expect_rewards_as_without_names();
}

TEST_F(TaskSignalsTest, OfATaskThatIsKnownBeforehandTheJournalHoldsNone) {
  Cluster known(small_study(20, 1));
  known.add_worker(1).description = naming(kNames);
  known.start();
  known.run(seconds(1000));
  EXPECT_EQ(known.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(known.signals.empty());
}

TEST_F(TaskSignalsTest, WhoNamesThemOtherwiseThanMostGetsNothing) {
  add_worker(1, kNames);
  add_worker(2, kOtherNames);
  add_worker(3, kNames);
  learn();
  EXPECT_EQ(names(), kNames);
  EXPECT_THAT(cluster_.log, names_the_signals_otherwise());
  EXPECT_EQ(num_answered_by(2), 0);
  EXPECT_GT(num_answered_by(1) + num_answered_by(3), 20);
}

TEST_F(TaskSignalsTest, MostWorkersDecideUntilTheFirstAnswer) {
  add_worker(1, kOtherNames, seconds(5));
  cluster_.start();
  cluster_.run(milliseconds(500));
  EXPECT_EQ(cluster_.core->workforce().facts_of(kTaskId)->signals, kOtherNames);
  EXPECT_EQ(names(), SignalNames{}) << "nothing follows from it yet";
  add_worker(2, kNames);
  add_worker(3, kNames);
  cluster_.run(seconds(1000));
  ASSERT_EQ(cluster_.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(names(), kNames);
  EXPECT_EQ(num_answered_by(1), 0);
}

TEST_F(TaskSignalsTest, WhoNamesNoneAgreesWithAll) {
  add_worker(1, {});
  add_worker(2, {});
  add_worker(3, kNames);
  learn();
  EXPECT_EQ(names(), kNames) << "of three who describe the task alike";
  EXPECT_GT(num_answered_by(1), 0);
  EXPECT_GT(num_answered_by(2), 0);
  expect_rewards_as_without_names();
}

TEST_F(TaskSignalsTest, TheFirstWhoNamesThemLaterIsBelieved) {
  Cluster cluster(small_study(20, 6), /*knows_task=*/false);
  const auto add = [&](protocol::WorkerId id, const SignalNames& names) {
    cluster.add_worker(id, milliseconds(300)).description = naming(names);
  };
  add(1, {});
  cluster.start();
  cluster.run(seconds(2));
  ASSERT_GT(cluster.journal.size(), 2U);
  EXPECT_TRUE(cluster.signals.empty());
  add(2, kNames);
  cluster.run(seconds(2));
  add(3, kOtherNames);
  cluster.run(seconds(1000));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->study().conditions[0].signals, kNames);
  ASSERT_EQ(cluster.signals.size(), 1U);
  EXPECT_GT(cluster.signals[0].first, 2U);
  EXPECT_THAT(cluster.log, names_the_signals_otherwise());
}

TEST_F(TaskSignalsTest, NamesOfTheJournalStay) {
  add_worker(1, kNames);
  cluster_.start();
  cluster_.run(seconds(10), [&] {
    if (cluster_.journal.size() == 5) cluster_.stop();
  });
  ASSERT_FALSE(cluster_.signals.empty());
  Cluster after(small_study(60, 1), /*knows_task=*/false);
  after.start();
  after.tell(SignalsRecovered{cluster_.signals[0].second});
  EXPECT_EQ(after.core->study().conditions[0].signals, kNames) << "before any worker is heard";
  after.recover(cluster_.journal);
  for (const protocol::WorkerId id : {2, 3}) after.add_worker(id).description = naming(kOtherNames);
  after.add_worker(4).description = naming(kNames);
  after.run(seconds(1000));
  ASSERT_EQ(after.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(after.core->study().conditions[0].signals, kNames) << "though most say otherwise";
  EXPECT_TRUE(after.signals.empty()) << "they are there already";
  EXPECT_THAT(after.log, names_the_signals_otherwise());
  for (const AcceptedResult& result : after.journal) {
    EXPECT_TRUE(result.worker_id == 4 || result.worker_id == 1) << result.worker_id;
  }
}

TEST_F(TaskSignalsTest, WithNamesOfTheJournalAWrongDescriptionIsItsWorkersTrouble) {
  Cluster after(small_study(20, 1), /*knows_task=*/false);
  after.start();
  after.tell(SignalsRecovered{{kTaskId, kNames}});
  after.add_worker(1).description =
      report_text({.input_dim = 2, .output_dim = 1, .time_limit_s = 10, .signals = {}});
  after.add_worker(2).description = report_text(
      {.input_dim = 2, .output_dim = 1, .time_limit_s = 10, .signals = {{"a", "b"}, {"c"}}});
  after.run(seconds(5));
  EXPECT_EQ(after.core->outcome(), LearnerCore::Outcome::kRunning);
  EXPECT_THAT(after.log, Contains(Field(&LogLine::text, HasSubstr("the task takes 2 inputs"))));
  after.add_worker(3).description = naming(kNames);
  after.run(seconds(1000));
  EXPECT_EQ(after.core->outcome(), LearnerCore::Outcome::kDone);
  for (const AcceptedResult& result : after.journal) EXPECT_EQ(result.worker_id, 3);
}

/// Before the first answer, and after it.
TEST_F(TaskSignalsTest, BesideAWorkerThatNamesNoneNamesMustStillBeThoseOfThePolicy) {
  for (const bool late : {false, true}) {
    Study study = small_study(20, 6);
    study.conditions[0].signals = kNames;
    Cluster cluster(study, /*knows_task=*/false);
    cluster.add_worker(1, milliseconds(300)).description = naming({});
    const auto add_other = [&] { cluster.add_worker(2).description = naming(kOtherNames); };
    if (!late) add_other();
    cluster.start();
    cluster.run(seconds(2));
    ASSERT_FALSE(cluster.journal.empty());
    if (late) add_other();
    cluster.run(seconds(1000));
    EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    EXPECT_THAT(cluster.log,
                Contains(Field(&LogLine::text, HasSubstr("outputs are torque_nm, those of the "
                                                         "policy are force_n"))));
    // One that has work before it has said what it names answers that.
    const auto of_other = std::ranges::count(cluster.journal, 2, &AcceptedResult::worker_id);
    EXPECT_LE(of_other, late ? 4 : 0);
  }
}

TEST_F(TaskSignalsTest, AJournalThatNamesOthersIsRefused) {
  const auto failure_of = [](const TaskSignals& signals) {
    LearnerCore core(small_study(20, 1), LearnerSettings{});
    Effects unsent;
    core.step({}, Started{}, unsent);
    core.step({}, SignalsRecovered{signals}, unsent);
    return core.failure();
  };
  EXPECT_EQ(failure_of({kTaskId, kNames}), "");
  EXPECT_THAT(failure_of({kTaskId, {{"a", "b"}, {"c"}}}), HasSubstr("inputs: has 2 names"));
  EXPECT_THAT(failure_of({content_hash("another"), kNames}), HasSubstr("does not have"));
  // Nor one of another task, as a program beside the learner describes it now.
  Cluster known(small_study(20, 1));
  known.start();
  known.tell(SignalsRecovered{{kTaskId, kNames}});
  EXPECT_EQ(known.core->failure(), "") << "it names none";
  LearnerSettings settings;
  settings.known_tasks[kTask] = *task_description_from_json(naming(kOtherNames));
  LearnerCore core(small_study(20, 1), settings);
  Effects unsent;
  core.step({}, Started{}, unsent);
  core.step({}, SignalsRecovered{{kTaskId, kNames}}, unsent);
  EXPECT_THAT(core.failure(), HasSubstr("outputs are force_n, those of this task are torque_nm"));
}

TEST_F(TaskSignalsTest, NamesThatAreNotThoseOfTheGivenPolicyAreTheirWorkersTrouble) {
  Study study = small_study(20, 1);
  study.conditions[0].signals = kNames;
  Cluster cluster(study, /*knows_task=*/false);
  cluster.add_worker(1).description = naming(kOtherNames);
  cluster.start();
  cluster.run(seconds(5));
  EXPECT_TRUE(cluster.journal.empty());
  EXPECT_THAT(cluster.log,
              Contains(Field(&LogLine::text, HasSubstr("the task's outputs are torque_nm, those of "
                                                       "the policy are force_n"))));
  cluster.add_worker(2).description = naming(kNames);
  cluster.run(seconds(1000));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

TEST_F(TaskSignalsTest, NamesThatATerminalWouldObeyAreRefusedWithTheDescription) {
  for (const std::string bad : {"\xc2\x9b"
                                "31m",
                                "time s", "a,b", "", "x\\y"}) {
    Cluster cluster(small_study(20, 1), /*knows_task=*/false);
    cluster.add_worker(1).description =
        nlohmann::json{{"input_dim", 1},      {"output_dim", 1},    {"reward_min", 0},
                       {"reward_max", 1},     {"time_limit_s", 10}, {"deterministic", true},
                       {"inputs", {"phase"}}, {"outputs", {bad}}}
            .dump();
    cluster.start();
    cluster.run(seconds(1));
    EXPECT_EQ(cluster.core->workforce().facts_of(kTaskId), nullptr) << bad;
    EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr("outputs: the name"))));
    EXPECT_THAT(cluster.log, Not(Contains(Field(&LogLine::text, HasSubstr("\xc2\x9b")))));
  }
}

class TaskAccountsTest : public ::testing::Test {
 protected:
  static TaskDescription task(double reward_max, const SignalNames& names = {}) {
    return {.input_dim = 1,
            .output_dim = 1,
            .reward_max = reward_max,
            .time_limit_s = 1,
            .signals = names};
  }
  TaskDescription elected(const TaskAccounts::Account& now = {}) const {
    return description_of(accounts_.most_say(kTaskId, now));
  }
  TaskAccounts accounts_;
};

TEST_F(TaskAccountsTest, VotesOfADescriptionCountWhateverNamesGoWithThem) {
  accounts_.note(kTaskId, 1, task(9, kNames));
  accounts_.note(kTaskId, 2, task(9, kNames));
  accounts_.note(kTaskId, 3, task(1, kNames));
  accounts_.note(kTaskId, 4, task(1, kOtherNames));
  accounts_.note(kTaskId, 5, task(1));
  EXPECT_EQ(elected(), task(1, kNames)) << "of one vote each, the first by name";
  EXPECT_EQ(elected(account_of(task(1, kOtherNames))), task(1, kOtherNames)) << "what is now stays";
  accounts_.note(kTaskId, 6, task(1, kOtherNames));
  EXPECT_EQ(elected(), task(1, kOtherNames));
}

TEST_F(TaskAccountsTest, EachWorkerHasOneVoteAndTakesItAlong) {
  for (const double reward_max : {1., 2., 3.}) accounts_.note(kTaskId, 1, task(reward_max));
  EXPECT_EQ(accounts_.of(kTaskId).size(), 1U);
  EXPECT_EQ(elected(), task(3));
  accounts_.forget(1);
  EXPECT_TRUE(accounts_.of(kTaskId).empty());
  EXPECT_EQ(accounts_.most_say(kTaskId, account_of(task(7))), account_of(task(7)));
}

TEST_F(TaskAccountsTest, FurtherOnesThanTheMostCountForNothing) {
  for (std::size_t i = 0; i < protocol::kDescriptionsMax; ++i) {
    accounts_.note(kTaskId, static_cast<int>(i), task(1, {{"t"}, {"x" + std::to_string(i)}}));
  }
  for (const int id : {100, 101}) accounts_.note(kTaskId, id, task(1, kNames));
  EXPECT_EQ(accounts_.of(kTaskId).size(), protocol::kDescriptionsMax);
  EXPECT_NE(elected().signals, kNames);
}

}  // namespace
}  // namespace treeroll::learner
