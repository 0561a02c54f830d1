// The service as its users run it: real daemons, real LCM on this host, real files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <thread>

#include "learner/journal/journal_file.h"
#include "learner/results/csv.h"
#include "tests/end_to_end/service.h"
#include "tests/thesis/run_study.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

/// Two conditions, five repetitions, about 5 s of processor time.
const std::string kFiveSwingUps =
    text_of({.seed = 4, .repetitions = 5, .rollouts = 100, .in_flight = 2});

/// Ten runs of a thousand roll-outs that take half a millisecond each.
constexpr const char* kTenThousand = R"(
[study]
name = "ten_thousand"
repetitions = 10
rollouts = 1000
[task]
name = "synthetic"
mode = "sleep"
duration_us = 500
[policy]
model = "flat"
components = [2]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
[[conditions]]
name = "flat"
)";

std::vector<std::string> worker_arguments(const Service& service, int processes) {
  return {"--processes", std::to_string(processes), "--lcm-url", service.url()};
}

Service::Learnt learn_with(const Service& service, std::vector<int> daemons) {
  std::vector<std::unique_ptr<Daemon>> workers;
  for (const int processes : daemons) {
    workers.push_back(std::make_unique<Daemon>(
        "treeroll-worker", worker_arguments(service, processes), service.directory()));
  }
  return service.learn(service.study(kFiveSwingUps), {});
}

TEST(LearningTest, TheSameFilesComeOutWhateverWorkersThereAreAndHoweverTheyDie) {
  const Service service;
  const Service::Learnt reference = learn_with(service, {1});
  ASSERT_EQ(reference.status, 0) << reference.log;
  ASSERT_EQ(reference.summary["ledger"]["applied"], 1000);
  for (const std::vector<int>& daemons : {std::vector<int>{2}, {5}, {1, 2}}) {
    const Service::Learnt learnt = learn_with(service, daemons);
    ASSERT_EQ(learnt.status, 0) << learnt.log;
    EXPECT_EQ(learnt.rollouts_csv, reference.rollouts_csv);
    EXPECT_EQ(learnt.runs_csv, reference.runs_csv);
  }

  // Two daemons; an evaluator of one is killed at work, then the whole daemon.
  Daemon doomed("treeroll-worker", worker_arguments(service, 2), service.directory());
  Daemon survivor("treeroll-worker", worker_arguments(service, 1), service.directory());
  Daemon learner("treeroll-learner",
                 {service.study(kFiveSwingUps).string(), "--json", "--lcm-url", service.url(),
                  "--state-dir", (service.directory() / "killed").string()},
                 service.directory());
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return learner.standard_error().find("has joined") != std::string::npos &&
           doomed.children().size() == 2;
  }));
  std::this_thread::sleep_for(milliseconds(500));
  const pid_t evaluator = doomed.children().at(0);
  ::kill(evaluator, SIGKILL);
  EXPECT_TRUE(eventually(
      seconds(10),
      [&] { return doomed.standard_error().find("ended by signal 9") != std::string::npos; }))
      << "the daemon says nothing of its evaluator\n"
      << doomed.standard_error();
  std::this_thread::sleep_for(milliseconds(300));
  doomed.kill(SIGKILL);
  const Service::Learnt learnt = service.learnt(learner, "killed", seconds(100));
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.rollouts_csv, reference.rollouts_csv);
  EXPECT_EQ(learnt.runs_csv, reference.runs_csv);
  EXPECT_GT(learnt.summary["ledger"]["reissued"], 0) << "the kills met no work";
  EXPECT_EQ(learnt.summary["ledger"]["failed"], 0);
}

TEST(LearningTest, TheServiceGivesToTheBitWhatOneProcessGives) {
  const Service service;
  const std::filesystem::path study = service.study(kFiveSwingUps);
  const std::vector<std::string> overrides{"study.rollouts=30", "study.repetitions=2"};
  const Service::Learnt learnt =
      service.learn(study, {"--local-workers", "2", "--set", overrides[0], "--set", overrides[1]});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const std::vector<RunRecord> runs = run_study(study, overrides);
  ASSERT_EQ(runs.size(), 4U);
  write_rollouts_csv(service.directory() / "rollouts.csv", runs);
  write_runs_csv(service.directory() / "runs.csv", runs);
  EXPECT_EQ(learnt.rollouts_csv, read_file(service.directory() / "rollouts.csv"));
  EXPECT_EQ(learnt.runs_csv, read_file(service.directory() / "runs.csv"));
}

TEST(LearningTest, TenThousandRolloutsWithAWorkerThatJoinsLateAndOneThatLeaves) {
  const Service service;
  Daemon leaver("treeroll-worker", worker_arguments(service, 2), service.directory());
  Daemon learner("treeroll-learner",
                 {service.study(kTenThousand).string(), "--json", "--lcm-url", service.url(),
                  "--state-dir", (service.directory() / "state").string()},
                 service.directory());
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return learner.standard_error().find("has joined") != std::string::npos;
  }));
  std::this_thread::sleep_for(milliseconds(500));
  Daemon joiner("treeroll-worker", worker_arguments(service, 1), service.directory());
  std::this_thread::sleep_for(milliseconds(700));
  leaver.kill(SIGTERM);
  EXPECT_EQ(leaver.wait(seconds(20)), 0) << leaver.standard_error();
  const Service::Learnt learnt = service.learnt(learner, "state", seconds(100));
  ASSERT_EQ(learnt.status, 0) << learnt.log;

  EXPECT_EQ(learnt.summary["ledger"]["issued"], 10'000);
  EXPECT_EQ(learnt.summary["ledger"]["applied"], 10'000);
  EXPECT_EQ(learnt.summary["ledger"]["pending"], 0);
  EXPECT_EQ(std::count(learnt.rollouts_csv.begin(), learnt.rollouts_csv.end(), '\n'), 10'001);
  ASSERT_EQ(learnt.summary["workers"].size(), 2U);
  std::int64_t accepted = 0;
  std::map<bool, double> last_heard_s;  // by whether it left
  for (const auto& worker : learnt.summary["workers"]) {
    EXPECT_GT(worker["accepted"], 100);
    accepted += worker["accepted"].get<std::int64_t>();
    const bool left = worker["pid"] == leaver.pid();
    last_heard_s[left] = worker["last_heard_s"];
    EXPECT_EQ(worker["first_heard_s"] > .3, !left);
  }
  EXPECT_LT(last_heard_s.at(true), last_heard_s.at(false));
  EXPECT_EQ(accepted, 10'000 + 2 * 10);  // and an evaluation of each start and final policy
}

TEST(LearningTest, LocalWorkersLearnAndEndWithTheirLearner) {
  const Service service;
  const Service::Learnt learnt = service.learn(
      service.study(kFiveSwingUps), {"--local-workers", "2", "--set", "study.rollouts=20", "--set",
                                     "task.plant=rk4", "--set", "task.step_s=0.005"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["ledger"]["applied"], 200);
  EXPECT_EQ(learnt.summary["conditions"].size(), 2U);

  Daemon learner("treeroll-learner",
                 {service.study(kFiveSwingUps).string(), "--local-workers", "1", "--lcm-url",
                  service.url(), "--state-dir", (service.directory() / "killed").string()},
                 service.directory());
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return learner.standard_error().find("has joined") != std::string::npos;
  }));
  ASSERT_EQ(learner.children().size(), 1U);
  const pid_t worker = learner.children()[0];
  learner.kill(SIGKILL);
  learner.wait(seconds(5));
  EXPECT_TRUE(eventually(seconds(20), [&] {
    return !std::filesystem::exists("/proc/" + std::to_string(worker)) ||
           read_file("/proc/" + std::to_string(worker) + "/stat").find(") Z ") != std::string::npos;
  }));
}

/// A learner that resumes `state`, with two local evaluators.
std::vector<std::string> resume_arguments(const Service& service) {
  return {"--resume",   (service.directory() / "state").string(),
          "--json",     "--local-workers",
          "2",          "--lcm-url",
          service.url()};
}

std::vector<std::string> start_arguments(const Service& service) {
  return {service.study(kTenThousand).string(),
          "--json",
          "--local-workers",
          "2",
          "--lcm-url",
          service.url(),
          "--state-dir",
          (service.directory() / "state").string(),
          "--set",
          "study.rollouts=300"};
}

TEST(LearningTest, AStoppedLearnerSaysSoAndGoesOnWhereItWas) {
  const Service service;
  Daemon learner("treeroll-learner", start_arguments(service), service.directory());
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return learner.standard_error().find("has joined") != std::string::npos;
  }));
  std::this_thread::sleep_for(milliseconds(300));
  learner.kill(SIGTERM);
  const Service::Learnt stopped = service.learnt(learner, "state", seconds(20));
  EXPECT_EQ(stopped.status, 3) << stopped.log;
  EXPECT_THAT(stopped.log, HasSubstr("--resume"));
  const auto applied = stopped.summary["ledger"]["applied"].get<std::int64_t>();
  EXPECT_GT(applied, 0);
  EXPECT_LT(applied, 3000);
  EXPECT_EQ(std::count(stopped.rollouts_csv.begin(), stopped.rollouts_csv.end(), '\n'),
            applied + 1);

  Daemon resumed("treeroll-learner", resume_arguments(service), service.directory());
  const Service::Learnt whole = service.learnt(resumed, "state", seconds(100));
  ASSERT_EQ(whole.status, 0) << whole.log;
  EXPECT_EQ(whole.summary["ledger"]["applied"], 3000);
  const Service::Learnt reference = service.learn(
      service.study(kTenThousand), {"--local-workers", "2", "--set", "study.rollouts=300"});
  EXPECT_EQ(whole.rollouts_csv, reference.rollouts_csv);
  EXPECT_EQ(whole.runs_csv, reference.runs_csv);
}

std::filesystem::path journal_of(const Service& service) {
  return service.directory() / "state" / "journal.lcmlog";
}

/// Lines of treeroll-replay --verify; the journal must verify.
std::string verified(const Service& service) {
  Daemon replay("treeroll-replay", {(service.directory() / "state").string(), "--verify"},
                service.directory());
  EXPECT_EQ(replay.wait(seconds(60)), 0) << replay.standard_error();
  return replay.standard_output();
}

TEST(LearningTest, AStudyThatIsLearntForATimeEndsWithWhatItHasThen) {
  const Service service;
  std::vector<std::string> arguments = start_arguments(service);
  arguments.back() = "study.rollouts=100000";
  arguments.insert(arguments.end(), {"--set", "study.stop_after_s=2"});
  Daemon learner("treeroll-learner", arguments, service.directory());
  const Service::Learnt learnt = service.learnt(learner, "state", seconds(60));
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_THAT(learnt.log, HasSubstr("the study's time of 2 s is up"));
  const auto applied = learnt.summary["ledger"]["applied"].get<std::int64_t>();
  EXPECT_GT(applied, 100);
  EXPECT_LT(applied, 1'000'000);
  EXPECT_EQ(learnt.summary["ledger"]["pending"], 0);
  EXPECT_EQ(std::count(learnt.rollouts_csv.begin(), learnt.rollouts_csv.end(), '\n'), applied + 1);
  EXPECT_EQ(std::count(learnt.runs_csv.begin(), learnt.runs_csv.end(), '\n'), 1 + 10);
  int num_evaluations = 0;
  EXPECT_TRUE(read_journal(journal_of(service), [&](const JournalRecord& record) {
    const auto* result = std::get_if<AcceptedResult>(&record);
    num_evaluations += result && result->key.number < 0 ? 1 : 0;
  }));
  EXPECT_EQ(num_evaluations, 2 * 10) << "of each run's start and final policy";
  const std::string said = verified(service);
  EXPECT_THAT(said, HasSubstr("files agree"));
  EXPECT_THAT(said, HasSubstr("learning   2.0 s"));

  // More of anything but time would learn nothing.
  for (const std::string more : {"study.repetitions=11", "study.rollouts=200000"}) {
    std::vector<std::string> extends = resume_arguments(service);
    extends.insert(extends.end(), {"--set", more});
    Daemon extended("treeroll-learner", extends, service.directory());
    EXPECT_EQ(extended.wait(seconds(30)), 2);
    EXPECT_THAT(extended.standard_error(), HasSubstr("study.stop_after_s: must be more as well"));
  }
  EXPECT_THAT(verified(service), HasSubstr("files agree"));
}

TEST(LearningTest, TimeBeforeASigkillCounts) {
  const Service service;
  std::vector<std::string> arguments = start_arguments(service);
  arguments.back() = "study.rollouts=100000";
  arguments.insert(arguments.end(), {"--set", "study.stop_after_s=5"});
  Daemon first("treeroll-learner", arguments, service.directory());
  const std::filesystem::path journal = journal_of(service);
  const auto counted = [&] {
    Duration elapsed{};
    if (!std::filesystem::exists(journal)) return elapsed;
    const auto tail = read_journal(journal, [&](const JournalRecord& record) {
      if (const auto* time = std::get_if<LearningTime>(&record)) elapsed = time->elapsed;
    });
    EXPECT_TRUE(tail);
    return elapsed;
  };
  ASSERT_TRUE(eventually(seconds(30), [&] { return counted() >= seconds(2); }));
  first.kill(SIGKILL);
  first.wait(seconds(10));
  const Duration before = counted();
  ASSERT_LT(before, seconds(5));

  Daemon resumed("treeroll-learner", resume_arguments(service), service.directory());
  const Service::Learnt learnt = service.learnt(resumed, "state", seconds(100));
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  Duration first_of_resumed{};
  int num_starts = 0;
  EXPECT_TRUE(read_journal(journal, [&](const JournalRecord& record) {
    if (std::holds_alternative<JournalStart>(record)) ++num_starts;
    const auto* time = std::get_if<LearningTime>(&record);
    if (time && num_starts == 2 && first_of_resumed == Duration{}) first_of_resumed = time->elapsed;
  }));
  EXPECT_GT(first_of_resumed, before) << "it went on from what had been counted";
  EXPECT_GE(counted(), seconds(5));
  EXPECT_THAT(verified(service), HasSubstr("files agree"));
}

TEST(LearningTest, ALearnerThatIsKilledAgainAndAgainEndsWithTheSameFiles) {
  const Service service;
  const Service::Learnt reference = service.learn(
      service.study(kTenThousand), {"--local-workers", "2", "--set", "study.rollouts=300"});
  std::vector<std::string> arguments = start_arguments(service);
  std::int64_t journalled = 0;
  for (int kill = 0; kill < 4; ++kill) {
    Daemon learner("treeroll-learner", arguments, service.directory());
    ASSERT_TRUE(eventually(seconds(20), [&] {
      return learner.standard_error().find("has joined") != std::string::npos;
    })) << learner.standard_error();
    std::this_thread::sleep_for(milliseconds(60 + 50 * kill));
    learner.kill(SIGKILL);
    learner.wait(seconds(10));
    const auto size = static_cast<std::int64_t>(
        std::filesystem::file_size(service.directory() / "state" / "journal.lcmlog"));
    EXPECT_GT(size, journalled);
    journalled = size;
    arguments = resume_arguments(service);
  }
  Daemon last("treeroll-learner", arguments, service.directory());
  const Service::Learnt whole = service.learnt(last, "state", seconds(100));
  ASSERT_EQ(whole.status, 0) << whole.log;
  EXPECT_EQ(whole.rollouts_csv, reference.rollouts_csv);
  EXPECT_EQ(whole.runs_csv, reference.runs_csv);
}

TEST(LearningTest, TheBusIsTakenFromTheEnvironmentToo) {
  const Service service;
  const std::map<std::string, std::string> environment{{"LCM_DEFAULT_URL", service.url()}};
  Daemon worker("treeroll-worker", {"--processes", "1"}, service.directory(), environment);
  Daemon learner("treeroll-learner",
                 {service.study(kTenThousand).string(), "--json", "--set", "study.rollouts=20",
                  "--state-dir", (service.directory() / "state").string()},
                 service.directory(), environment);
  const Service::Learnt learnt = service.learnt(learner, "state", seconds(60));
  EXPECT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["ledger"]["applied"], 200);
}

TEST(LearningTest, WhatWasLearntIsKeptThoughTheSummaryCannotBeWritten) {
  const Service service;
  const std::string study = service.study(kTenThousand).string();
  for (const std::string output : {"| true", "> /dev/full"}) {
    const std::filesystem::path state =
        service.directory() / (output == "| true" ? "gone" : "full");
    Daemon learner("/bin/sh",
                   {"-c", R"("$0" "$@" )" + output, executable("treeroll-learner").string(), study,
                    "--json", "--lcm-url", service.url(), "--local-workers", "1", "--set",
                    "study.rollouts=20", "--state-dir", state.string()},
                   service.directory());
    const int status = learner.wait(seconds(60));
    if (output == "> /dev/full") {
      EXPECT_EQ(status, 1);
      EXPECT_THAT(learner.standard_error(),
                  HasSubstr("cannot write to standard output: No space left on device"));
    }
    EXPECT_NE(read_file(state / "rollouts.csv"), "") << output;
    EXPECT_NE(read_file(state / "runs.csv"), "") << output;
    const Result<JournalTail> tail =
        read_journal(state / "journal.lcmlog", [](const JournalRecord&) {});
    ASSERT_TRUE(tail) << tail.error().message;
    EXPECT_TRUE(tail->sealed) << output;
  }
}

TEST(LearningTest, FailedAndCrashingRolloutsAreCountedAndTheStudyEnds) {
  const Service service;
  const Service::Learnt learnt = service.learn(
      service.study(kTenThousand),
      {"--local-workers", "2", "--set", "study.rollouts=30", "--set", "study.repetitions=2",
       "--set", "task.fail_fraction=0.2", "--set", "task.crash_fraction=0.1"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["ledger"]["applied"], 60);
  EXPECT_GT(learnt.summary["ledger"]["failed"], 0);
  EXPECT_THAT(learnt.rollouts_csv, HasSubstr(",0,failed"));
  EXPECT_THAT(learnt.rollouts_csv, HasSubstr(",0,crashed"));
}

}  // namespace
}  // namespace treeroll::end_to_end
