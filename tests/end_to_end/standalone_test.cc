// A state directory is all that is needed: moved, without the files the study was made from, and
// with programs that would make something else of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <functional>

#include "learner/journal/journal_file.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

/// Starts from a CSV demonstration beside it.
std::string study_text(int rollouts, int duration_us) {
  return "[study]\nname = \"moved\"\nrepetitions = 2\nrollouts = " + std::to_string(rollouts) +
         "\n[task]\nname = \"synthetic\"\nmode = \"sleep\"\nduration_us = " +
         std::to_string(duration_us) + R"(
[policy]
components = [2, 4]
demonstration = {kind = "csv", files = ["demo.csv"], inputs = ["t"], outputs = ["u"]}
[exploration]
noise_variance = [0.01, 0.1, 0.01]
convergence_window = 10
[[conditions]]
name = "tree"
)";
}

class StandaloneTest : public ::testing::Test {
 protected:
  StandaloneTest() {
    std::string demonstration = "t,u\n";
    for (int i = 0; i < 60; ++i) {
      demonstration += std::to_string(i / 30.) + "," + std::to_string(i % 7 / 3.) + "\n";
    }
    write_file(service_.directory() / "demo.csv", demonstration);
  }

  Said run(const std::string& program, const std::vector<std::string>& arguments) const {
    return service_.run(program, arguments);
  }
  Said learn(const fs::path& study, const fs::path& state) const {
    return run("treeroll-learner", {study.string(), "--lcm-url", service_.url(), "--local-workers",
                                    "2", "--state-dir", state.string()});
  }
  std::vector<std::string> resume_of(const fs::path& state) const {
    return {"--resume", state.string(), "--lcm-url", service_.url(), "--local-workers", "2"};
  }

  /// The whole folder moved, and the demonstration deleted.
  fs::path moved(const fs::path& state) const {
    const fs::path place = service_.directory() / "elsewhere" / "kept";
    fs::create_directories(place.parent_path());
    fs::rename(state, place);
    fs::remove(service_.directory() / "demo.csv");
    return place;
  }

  /// A worker executable that says of tasks what the shipped one says, changed by sed.
  fs::path worker_that_says(const std::string& sed) const {
    const fs::path program = service_.directory() / "other-worker";
    const std::string shipped = executable("treeroll-worker").string();
    write_file(program, "#!/bin/sh\nif [ \"$1\" = --describe-task ]; then\n  " + shipped +
                            " --describe-task | sed '" + sed + "'\nelse\n  exec " + shipped +
                            " \"$@\"\nfi\n");
    fs::permissions(program, fs::perms::owner_all);
    return program;
  }

  const Service service_;
};

TEST_F(StandaloneTest, AMovedDirectoryVerifiesEvaluatesAndReportsToTheSameBytes) {
  const fs::path state = service_.directory() / "state";
  ASSERT_EQ(learn(service_.study(study_text(40, 200)), state).status, 0);
  const std::string policy = read_file(state / "policies/tree-0.json");
  const auto evaluate = [&](const fs::path& directory) {
    return run("treeroll-evaluate", {(directory / "policies/tree-0.json").string(),
                                     (directory / "study.toml").string(), "--json"});
  };
  const auto reward_of = [&](const fs::path& directory) {
    const Said said = evaluate(directory);
    EXPECT_EQ(said.status, 0) << said.errors;
    return nlohmann::json::parse(said.output)["reward"].get<double>();
  };
  const auto report = [&](const fs::path& directory) {
    const Said said =
        run("treeroll-report", {directory.string(), "--output", (directory / "report").string()});
    EXPECT_EQ(said.status, 0) << said.errors;
    return read_file(directory / "report/report.html");
  };
  const double reward = reward_of(state);
  const std::string page = report(state);
  fs::remove_all(state / "report");

  const fs::path place = moved(state);
  const Said verified = run("treeroll-replay", {place.string(), "--verify", "--refit"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_THAT(verified.output, HasSubstr("starts     1 fits give what the study holds\n"));
  EXPECT_THAT(verified.output, HasSubstr("results    6 files agree\n"));
  EXPECT_THAT(verified.output, HasSubstr("programs   treeroll 0."));
  const Said summary = run("treeroll-replay", {place.string()});
  EXPECT_EQ(summary.status, 0) << summary.errors;
  EXPECT_EQ(reward_of(place), reward);
  EXPECT_EQ(report(place), page);
  // And its study can be learnt again.
  const fs::path again = service_.directory() / "again";
  ASSERT_EQ(learn(place / "study.toml", again).status, 0);
  for (const char* file : {"study.toml", "rollouts.csv", "runs.csv", "policies/tree-0.json"}) {
    EXPECT_EQ(read_file(again / file), read_file(place / file)) << file;
  }
}

TEST_F(StandaloneTest, AMovedDirectoryGoesOnToTheBitsItWouldHaveHad) {
  const fs::path study = service_.study(study_text(60, 3000));
  const fs::path whole = service_.directory() / "whole";
  ASSERT_EQ(learn(study, whole).status, 0);
  const fs::path state = service_.directory() / "state";
  {
    Daemon learner("treeroll-learner",
                   {study.string(), "--lcm-url", service_.url(), "--local-workers", "2",
                    "--state-dir", state.string()},
                   service_.directory());
    ASSERT_TRUE(eventually(seconds(30), [&] {
      std::error_code none;
      return fs::file_size(state / "journal.lcmlog", none) > 2000 && !none;
    }));
    learner.kill(SIGKILL);
    learner.wait(seconds(10));
  }
  const fs::path place = moved(state);
  const Said resumed = run("treeroll-learner", resume_of(place));
  EXPECT_EQ(resumed.status, 0) << resumed.errors;
  for (const char* file : {"study.toml", "rollouts.csv", "runs.csv", "policies/tree-0.json"}) {
    EXPECT_EQ(read_file(place / file), read_file(whole / file)) << file;
  }
}

TEST_F(StandaloneTest, AWorkerProgramOfOtherDefaultsIsRefusedWithKeyAndValues) {
  const fs::path state = service_.directory() / "state";
  ASSERT_EQ(learn(service_.study(study_text(20, 200)), state).status, 0);
  EXPECT_THAT(read_file(state / "study.toml"), HasSubstr("[conditions.task.described]\n"));
  EXPECT_THAT(read_file(state / "study.toml"), HasSubstr("time_limit_s = "));
  const auto expect_refused = [&](const std::string& sed, const std::string& said) {
    const std::string worker = worker_that_says(sed).string();
    std::vector<std::string> resume = resume_of(state);
    resume.insert(resume.end(), {"--worker-program", worker});
    const Said resumed = run("treeroll-learner", resume);
    EXPECT_EQ(resumed.status, 2) << resumed.errors;
    EXPECT_THAT(resumed.errors, HasSubstr(said));
    EXPECT_THAT(resumed.errors, HasSubstr((state / "study.toml").string()));
    const Said evaluated =
        run("treeroll-evaluate", {(state / "policies/tree-0.json").string(),
                                  (state / "study.toml").string(), "--worker-program", worker});
    EXPECT_EQ(evaluated.status, 2);
    EXPECT_THAT(evaluated.errors, HasSubstr(said));
  };
  expect_refused("s/\"duration_us\":200/\"duration_us\":300/",
                 "task.duration_us = 300: was 200 when the study began");
  expect_refused("s/\"settings\":{/\"settings\":{\"wind\":3,/",
                 "task.wind = 3: did not exist when the study began");
  expect_refused("s/\"input_dim\":1/\"input_dim\":2/",
                 "task.described.input_dim = 2: was 1 when the study began");
  expect_refused("s/\"description\":{/\"description\":{\"version\":\"2\",/",
                 "task.described.version = \"2\": was \"\" when the study began");
}

TEST_F(StandaloneTest, AMixtureOfNumericClassesIsShownByReplayAndReport) {
  const fs::path state = service_.directory() / "state";
  ASSERT_EQ(learn(service_.study(study_text(20, 200)), state).status, 0);
  std::vector<JournalRecord> records;
  ASSERT_TRUE(read_journal(state / "journal.lcmlog",
                           [&](const JournalRecord& record) { records.push_back(record); }));
  // As if another host had given the first three results: the chain of checks holds.
  int num_results = 0;
  std::vector<JournalRecord> mixed;
  for (JournalRecord record : records) {
    if (auto* result = std::get_if<AcceptedResult>(&record); result && num_results < 3) {
      if (num_results++ == 0) mixed.emplace_back(KnownWorker{99, "aarch64 glibc 2.31", "far"});
      result->worker_id = 99;
    }
    mixed.push_back(record);
  }
  fs::remove(state / "journal.lcmlog");
  {
    JournalWriter writer(state / "journal.lcmlog");
    writer.continue_after({});
    for (const JournalRecord& record : mixed) writer.append(record, 0);
    writer.sync();
  }
  const Said verified = run("treeroll-replay", {state.string(), "--verify"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_THAT(verified.output, HasSubstr("classes    "));
  EXPECT_THAT(verified.output, HasSubstr("aarch64 glibc 2.31 (3)"));
  const Said reported =
      run("treeroll-report", {state.string(), "--output", (state / "report").string()});
  EXPECT_EQ(reported.status, 0) << reported.errors;
  EXPECT_THAT(read_file(state / "report/report.md"),
              HasSubstr("computed by workers of several numeric classes: "));
}

TEST_F(StandaloneTest, AStudyOfAnotherClassWaitsAndSaysForWhat) {
  std::string text = study_text(20, 200);
  text.insert(text.find("[task]"), "numeric_class = \"riscv64\"\n");
  Daemon learner("treeroll-learner",
                 {service_.study(text).string(), "--lcm-url", service_.url(), "--local-workers",
                  "1", "--state-dir", (service_.directory() / "state").string()},
                 service_.directory());
  EXPECT_TRUE(eventually(seconds(30), [&] {
    return learner.standard_error().find("the study demands riscv64") != std::string::npos;
  })) << learner.standard_error();
  learner.kill(SIGTERM);
  EXPECT_EQ(learner.wait(seconds(20)), 3);
}

}  // namespace
}  // namespace treeroll::end_to_end
