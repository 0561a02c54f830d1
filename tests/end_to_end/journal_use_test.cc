// What a journal is good for beside resuming: rows, policies, more roll-outs, a look while it
// grows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/end_to_end/replay.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using JournalUseTest = ReplayTest;

/// Over a switch of layers too, where the length of theta may change.
TEST_F(JournalUseTest, ARowSaysWhereThetaCameFromAndWhoEvaluatedIt) {
  const fs::path directory = learn("rows", "sequence", 150);
  const Said said = run("treeroll-replay", {directory.string(), "--export", "jsonl"});
  std::istringstream lines(said.output);
  std::map<int, int> layers;           // by run, the last
  std::map<int, int> num_evaluations;  // by number: of starts, of final policies
  int num_switches = 0;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json row = nlohmann::json::parse(line);
    // A reader of JSON with numbers of 53 bits has the id that --without-worker takes.
    EXPECT_GT(std::stoll(row["worker"].get<std::string>()), 0);
    EXPECT_GT(std::stoll(row["learner"].get<std::string>()), 0);
    EXPECT_GT(row["pid"].get<int>(), 0);
    EXPECT_FALSE(row["host"].get<std::string>().empty());
    EXPECT_GE(row["duration_s"].get<double>(), 5e-4);  // the task sleeps that long
    if (row["rollout"] < 0) {
      ++num_evaluations[row["rollout"]];
      EXPECT_TRUE(row["mean"].is_null());
      continue;
    }
    EXPECT_EQ(row["theta"].size(), row["mean"].size());
    EXPECT_EQ(row["theta"].size(), row["noise_deviations"].size());
    const int number = row["run"];
    if (layers.contains(number) && layers[number] != row["layer"].get<int>()) ++num_switches;
    layers[number] = row["layer"];
  }
  EXPECT_EQ(num_evaluations, (std::map<int, int>{{-2, 4}, {-1, 4}}));
  EXPECT_GE(num_switches, 1);
}

TEST_F(JournalUseTest, AFullDiskIsNoFaultOfTheJournal) {
  const fs::path directory = learn("full");
  const Said said =
      run("treeroll-replay", {directory.string(), "--export", "csv", "--output", "/dev/full"});
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.errors, HasSubstr("/dev/full"));
  EXPECT_THAT(said.errors, HasSubstr("No space left on device"));
  EXPECT_THAT(said.errors, Not(HasSubstr("journal.lcmlog")));
}

TEST_F(JournalUseTest, WritesThePolicyOfAnyRolloutAndTheStart) {
  const fs::path directory = learn("policies");
  // The best of run 1 lies among the results: the policy of its roll-out is the same text.
  std::istringstream rollouts(read_file(directory / "rollouts.csv"));
  double best = -1;
  std::string number;
  for (std::string line; std::getline(rollouts, line);) {
    std::vector<std::string> fields;
    std::istringstream parts(line);
    for (std::string field; std::getline(parts, field, ',');) fields.push_back(field);
    if (fields[2] != "1" || std::stod(fields[5]) <= best) continue;
    best = std::stod(fields[5]);
    number = fields[3];
  }
  ASSERT_FALSE(number.empty());
  const fs::path file = service_.directory() / "policy.json";
  const Said said = run("treeroll-replay",
                        {directory.string(), "--policy", "1:" + number, "--output", file.string()});
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_EQ(read_file(file), read_file(directory / "policies" / "tree-1.json"));

  const Said start = run("treeroll-replay", {directory.string(), "--start", "tree"});
  EXPECT_THAT(start.output, StartsWith("{\"format\":\"treeroll-policy\""));
  EXPECT_EQ(run("treeroll-replay", {directory.string(), "--policy", "1:-1"}).status, 0);
  const auto refusal = [&](const std::string& option, const std::string& value) {
    const Said refused = run("treeroll-replay", {directory.string(), option, value});
    EXPECT_EQ(refused.status, 2) << value;
    return refused.errors;
  };
  EXPECT_THAT(refusal("--start", "bush"),
              HasSubstr("must be a condition of the study: tree, flat"));
  EXPECT_THAT(refusal("--policy", "1:60"), HasSubstr("run 1 has 60 results so far"));
  EXPECT_THAT(refusal("--policy", "4:0"), HasSubstr("the study has the runs 0 to 3"));
  for (const std::string value : {"1", "1:", "x:2", "1:2:3", "1:2.5", ":", "99999999999:1"}) {
    EXPECT_THAT(refusal("--policy", value), HasSubstr("must be RUN:ROLLOUT"));
  }
}

TEST_F(JournalUseTest, AnExtendedStudyHasTheFilesOfOneThatWasThatLargeFromTheStart) {
  for (const std::string order : {"sequence", "arrival"}) {
    const fs::path directory = learn("extended-" + order, order);
    const Said extended =
        run("treeroll-learner",
            {"--resume", directory.string(), "--local-workers", "2", "--lcm-url", service_.url(),
             "--set", "study.rollouts=90", "--set", "study.repetitions=3"});
    EXPECT_EQ(extended.status, 0) << extended.errors;
    EXPECT_THAT(extended.errors, HasSubstr("extended: study.repetitions from 2 to 3, "
                                           "study.rollouts from 60 to 90"));
    const Said said = verify(directory);
    EXPECT_EQ(said.status, 0) << said.errors;
    EXPECT_THAT(said.output, HasSubstr("extension  study.repetitions from 2 to 3"));
    EXPECT_THAT(said.output, HasSubstr("files agree\n"));
    if (order == "arrival") continue;

    const fs::path whole = service_.directory() / "whole";
    Daemon learner("treeroll-learner",
                   {(directory / "study.toml").string(), "--lcm-url", service_.url(),
                    "--local-workers", "2", "--state-dir", whole.string()},
                   service_.directory());
    EXPECT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
    for (const char* file : {"study.toml", "rollouts.csv", "runs.csv", "policies/tree-2.json"}) {
      EXPECT_EQ(read_file(directory / file), read_file(whole / file)) << file;
    }
    const Said fewer = run("treeroll-learner", {"--resume", directory.string(), "--lcm-url",
                                                service_.url(), "--set", "study.rollouts=89"});
    EXPECT_EQ(fewer.status, 2);
    EXPECT_THAT(fewer.errors, HasSubstr("study.rollouts = 89: must be at least 90"));
    EXPECT_EQ(verify(directory).status, 0);
  }
}

TEST_F(JournalUseTest, AStudyThatIsLearntOrWasKilledIsReportedFromItsJournal) {
  const fs::path directory = service_.directory() / "running";
  Daemon learner(
      "treeroll-learner",
      {service_.study(study_text("sequence")).string(), "--lcm-url", service_.url(),
       "--local-workers", "1", "--set", "study.rollouts=100000", "--state-dir", directory.string()},
      service_.directory());
  const fs::path journal = directory / "journal.lcmlog";
  ASSERT_TRUE(eventually(seconds(30),
                         [&] { return fs::exists(journal) && fs::file_size(journal) > 20'000; }));
  int round = 0;
  const auto looks = [&] {
    const fs::path results = service_.directory() / ("results" + std::to_string(round));
    const fs::path report = service_.directory() / ("report" + std::to_string(round++));
    const std::vector<std::string> write_results = {directory.string(), "--results",
                                                    results.string()};
    const Said written = run("treeroll-replay", write_results);
    EXPECT_EQ(written.status, 0) << written.errors;
    EXPECT_THAT(written.output, HasSubstr("of 400000 roll-outs are learnt and 0 of 4 runs have "
                                          "ended: treeroll-learner --resume"));
    EXPECT_TRUE(fs::exists(results / "policies" / "tree-0.json"));
    EXPECT_EQ(run("treeroll-replay", write_results).status, 2);  // it is not empty any more
    const Said reported = run("treeroll-report", {directory.string(), "--output", report.string()});
    EXPECT_EQ(reported.status, 0) << reported.errors;
    EXPECT_THAT(reported.errors, HasSubstr("small is not complete: "));
    EXPECT_THAT(read_file(report / "report.md"), HasSubstr("The study is not complete: "));
    const nlohmann::json json = nlohmann::json::parse(read_file(report / "report.json"));
    EXPECT_TRUE(json["studies"][0]["missing"].is_string());
    EXPECT_FALSE(fs::exists(directory / "runs.csv"));
  };
  looks();  // while it learns
  learner.kill(SIGKILL);
  learner.wait(seconds(10));
  fs::resize_file(journal, fs::file_size(journal) - 5);  // torn
  looks();
}

}  // namespace
}  // namespace treeroll::end_to_end
