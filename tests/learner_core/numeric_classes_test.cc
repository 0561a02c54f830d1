// Workers of several numeric classes: what is noted of them, and a study that takes one alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "learner/core/answer.h"
#include "learner/core/numeric_classes.h"
#include "learner/core/worker_table.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

Study study_of(const std::string& numeric_class) {
  Study study = small_study(30, 4);
  study.numeric_class = numeric_class;
  return study;
}

std::string all_of(const std::vector<LogLine>& log) {
  std::string text;
  for (const LogLine& line : log) text += line.text + "\n";
  return text;
}

/// A cluster of three workers, one of another class.
struct MixedCluster : Cluster {
  explicit MixedCluster(const std::string& demand) : Cluster(study_of(demand)) {
    add_worker(1).numeric_class = "x86_64";
    add_worker(2).numeric_class = "aarch64";
    add_worker(3).numeric_class = "x86_64";
  }
  void learn() {
    start();
    run(seconds(60));
    ASSERT_EQ(core->outcome(), LearnerCore::Outcome::kDone);
  }
};

TEST(NumericClassesTest, AMixtureIsCountedAndSaid) {
  MixedCluster cluster("any");
  cluster.learn();
  const std::map<std::string, std::int64_t>& counts = cluster.core->results_by_class();
  ASSERT_EQ(counts.size(), 2U);
  EXPECT_GT(counts.at("aarch64"), 0);
  EXPECT_EQ(counts.at("aarch64") + counts.at("x86_64"), 4 * 32);
  EXPECT_THAT(all_of(cluster.log), HasSubstr("is of another numeric class"));
}

TEST(NumericClassesTest, WorkersOfOneClassAreWorthNoWord) {
  Cluster cluster(study_of("any"));
  cluster.add_worker(1);
  cluster.add_worker(2);
  cluster.start();
  cluster.run(seconds(60));
  EXPECT_EQ(cluster.core->results_by_class().size(), 1U);
  EXPECT_THAT(all_of(cluster.log), Not(HasSubstr("numeric class")));
}

TEST(NumericClassesTest, AStudyMayDemandAClassByItsName) {
  MixedCluster cluster("aarch64");
  cluster.learn();
  const std::map<std::string, std::int64_t> expected{{"aarch64", 4 * 32}};
  EXPECT_EQ(cluster.core->results_by_class(), expected);
  EXPECT_EQ(cluster.workers[0]->num_requests, 0);
  EXPECT_THAT(all_of(cluster.log), HasSubstr("gets no roll-outs: it is of numeric class x86_64, "
                                             "the study demands aarch64"));
}

TEST(NumericClassesTest, OneClassIsThatOfTheFirstResult) {
  MixedCluster cluster("one");
  cluster.learn();
  EXPECT_EQ(cluster.core->results_by_class().size(), 1U);
  EXPECT_EQ(cluster.core->results_by_class().begin()->second, 4 * 32);
}

TEST(NumericClassesTest, AStudyThatWaitsForAClassSaysSo) {
  Cluster cluster(study_of("riscv"));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(6));
  std::string waiting_for;
  for (const protocol::Message& message : cluster.sent) {
    const auto* status = std::get_if<protocol::LearnerStatus>(&message);
    if (status) waiting_for = status->waiting_for;
  }
  EXPECT_EQ(waiting_for,
            "none of the 1 workers takes roll-outs: the study demands numeric class riscv");
}

TEST(NumericClassesTest, AWorkerThatWasOnlySilentKeepsItsNamesAndItsClass) {
  WorkerTable table;
  WorkerEntry* worker = table.hear(4, TimePoint{});
  ASSERT_TRUE(worker);
  worker->host = "far";
  worker->pid = 12;
  worker->numeric_class = "aarch64";
  worker->noted_class = "aarch64";
  worker->other_class = true;
  const TimePoint later = TimePoint{} + protocol::kWorkerSilence + seconds(1);
  ASSERT_EQ(table.remove_silent(later).size(), 1U);
  worker = table.hear(4, later);  // an answer, before its next heartbeat
  ASSERT_TRUE(worker);
  EXPECT_EQ(describe(*worker), "worker 4 (far pid 12)");
  EXPECT_EQ(worker->numeric_class, "aarch64");
  EXPECT_EQ(worker->noted_class, "aarch64");
  EXPECT_TRUE(worker->other_class);
}

/// Journals and studies of version 0.2.0 know no bits of ODE.
TEST(NumericClassesTest, WhoTellsMoreOfItselfIsOfTheClassOfBefore) {
  NumericClasses named("x86_64 elementary 2");
  EXPECT_TRUE(named.allows("x86_64 elementary 2"));
  EXPECT_TRUE(named.allows("x86_64 elementary 2 ode 01234567"));
  EXPECT_FALSE(named.allows("x86_64 elementary 22 ode 01234567"));
  EXPECT_FALSE(named.allows("x86_64 elementary 2 program 01234567"));
  NumericClasses exact("x86_64 elementary 2 ode 01234567");
  EXPECT_FALSE(exact.allows("x86_64 elementary 2"));
  EXPECT_FALSE(exact.allows("x86_64 elementary 2 ode 01234567 ode 1"));

  NumericClasses one("one");
  EXPECT_TRUE(one.count("x86_64 elementary 2"));  // of a journal
  EXPECT_TRUE(one.allows("x86_64 elementary 2 ode 01234567"));
  EXPECT_TRUE(one.allows("x86_64 elementary 2 ode 76543210"));
  EXPECT_TRUE(one.count("x86_64 elementary 2 ode 01234567"));
  EXPECT_FALSE(one.allows("x86_64 elementary 2 ode 76543210")) << "the first one has decided";
  EXPECT_EQ(one.demanded(), "x86_64 elementary 2 ode 01234567");
}

TEST(NumericClassesTest, AClassThatNobodyNamedIsNone) {
  NumericClasses one("one");
  EXPECT_FALSE(one.allows(""));
  EXPECT_FALSE(one.count(""));
  EXPECT_EQ(one.index(""), kUnknownClass);
  EXPECT_TRUE(one.counts().empty());
  EXPECT_TRUE(one.allows("x86_64"));  // the first result decides, not the one without a class
  EXPECT_TRUE(one.count("x86_64"));
  EXPECT_FALSE(one.allows("aarch64"));
  EXPECT_TRUE(NumericClasses("any").allows(""));
}

/// A foreign worker, say.
TEST(NumericClassesTest, AWorkerThatNamesNoClassIsTakenOnlyWhereAnyWillDo) {
  Cluster any(study_of("any"));
  any.add_worker(1).numeric_class = "";
  any.start();
  any.run(seconds(60));
  EXPECT_EQ(any.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(any.core->results_by_class().empty());
  Cluster one(study_of("one"));
  one.add_worker(1).numeric_class = "";
  one.add_worker(2).numeric_class = "x86_64";
  one.start();
  one.run(seconds(60));
  EXPECT_EQ(one.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(one.workers[0]->num_requests, 0);
  EXPECT_THAT(all_of(one.log), HasSubstr("it is of numeric class unknown, the study demands one"));
}

TEST(NumericClassesTest, TheJournalKnowsEachWorkerBeforeItsFirstResult) {
  MixedCluster cluster("one");
  Effects effects;
  cluster.start();
  cluster.run(seconds(60));
  // What a core notes of a worker, and in which order, decides what a resumed one knows.
  LearnerCore resumed(study_of("one"),
                      {.learner_id = 5, .batch_bytes_max = 60000, .known_tasks = {}});
  resumed.step(TimePoint{}, Started{}, effects);
  resumed.step(TimePoint{}, WorkerRecovered{{cluster.journal[0].worker_id, "x86_64", "host"}},
               effects);
  resumed.step(TimePoint{}, ResultRecovered{cluster.journal[0]}, effects);
  const std::map<std::string, std::int64_t> expected{{"x86_64", 1}};
  EXPECT_EQ(resumed.results_by_class(), expected);
  resumed.step(TimePoint{}, RecoveryFinished{}, effects);
  FakeWorker other(9, milliseconds(1));
  other.numeric_class = "aarch64";
  effects.clear();
  resumed.step(TimePoint{}, MessageReceived{other.status(5)}, effects);
  std::string log;
  for (const Effect& effect : effects) {
    if (const auto* line = std::get_if<LogLine>(&effect)) log += line->text;
  }
  EXPECT_THAT(log, HasSubstr("the study demands x86_64"));
}

TEST(NumericClassesTest, AWorkerIsNotedOnceBeforeItsResultsWithItsNamesCut) {
  LearnerCore core(study_of("any"), {.learner_id = 77,
                                     .batch_bytes_max = 60000,
                                     .known_tasks = {{study_of("any").conditions[0].task_content,
                                                      TaskDescription{1, 1, 0, 1, 10, true}}}});
  FakeWorker worker(1, milliseconds(1));
  worker.numeric_class = std::string(1000, 'x');
  worker.host = std::string(1000, 'h');
  KnownWorker noted;
  TimePoint now{};
  Effects effects;
  std::vector<std::string> order;
  const auto step = [&](const Event& event) {
    effects.clear();
    core.step(now, event, effects);
    std::vector<protocol::Message> replies;
    for (const Effect& effect : effects) {
      if (const auto* known = std::get_if<AppendWorker>(&effect)) {
        order.emplace_back("worker");
        noted = known->worker;
      }
      if (std::holds_alternative<AppendResult>(effect)) order.emplace_back("result");
      if (const auto* send = std::get_if<SendMessage>(&effect)) {
        for (auto& reply : worker.receive(send->message, now)) replies.push_back(reply);
      }
    }
    return replies;
  };
  const auto tell = [&](const Event& event) {
    auto replies = step(event);
    while (!replies.empty()) {
      std::vector<protocol::Message> more;
      for (const protocol::Message& reply : replies) {
        for (auto& next : step(MessageReceived{reply})) more.push_back(next);
      }
      for (auto& next : step(InboxDrained{})) more.push_back(next);
      replies = std::move(more);
    }
  };
  tell(Started{});
  tell(RecoveryFinished{});
  tell(MessageReceived{worker.status(77)});
  for (int i = 0; i < 100 && order.size() < 4; ++i) {
    now += milliseconds(1);
    tell(TimerFired{});
    if (!worker.has_work()) continue;
    tell(MessageReceived{worker.finish(77, now)});
    tell(SyncBegun{});
    tell(JournalSynced{});
  }
  ASSERT_GE(order.size(), 4U);
  EXPECT_EQ(order[0], "worker");
  EXPECT_EQ(noted, (KnownWorker{1, std::string(protocol::kNumericClassBytesMax, 'x'),
                                std::string(protocol::kHostNameBytesMax, 'h'), 1}));
  for (std::size_t i = 1; i < order.size(); ++i) EXPECT_EQ(order[i], "result");
}

}  // namespace
}  // namespace treeroll::learner
