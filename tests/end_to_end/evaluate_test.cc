// treeroll-evaluate as its users run it, on what a study has left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>

#include "common/numbers/elementary.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

const std::string kSwingUp = text_of({.repetitions = 2, .rollouts = 40});

constexpr const char* kSynthetic = R"([study]
name = "synthetic"
rollouts = 5
[task]
name = "synthetic"
[policy]
model = "flat"
components = [2]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
[[conditions]]
name = "plain"
)";

/// One component over one input and one output.
constexpr const char* kPolicy = R"({"format": "treeroll-policy", "version": 1,
  "frames": "eigenvector", "layout": "means", "input_dim": 1, "layer": 1,
  "layers": [[{"parent": -1, "prior": 1, "mean": [1, 1], "covariance": [1, 1, 2]}]]})";

std::vector<std::vector<std::string>> rows_of(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(field);
  }
  return rows;
}

struct Evaluated {
  int status = -1;
  std::string output;
  std::string error;
};

Evaluated evaluate(const Service& service, const std::vector<std::string>& arguments) {
  Daemon process("treeroll-evaluate", arguments, service.directory());
  const int status = process.wait(seconds(30));
  return {status, process.standard_output(), process.standard_error()};
}

TEST(EvaluateTest, GivesThePolicyOfEachRunItsBestRewardToTheBitAndATraceThatShowsIt) {
  const Service service;
  const fs::path state = service.directory() / "state";
  Daemon learner("treeroll-learner",
                 {service.study(kSwingUp).string(), "--json", "--local-workers", "2", "--lcm-url",
                  service.url(), "--state-dir", state.string()},
                 service.directory());
  const Service::Learnt learnt = service.learnt(learner, "state", seconds(60));
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  const auto runs = rows_of(learnt.runs_csv);
  ASSERT_EQ(runs.size(), 5U);
  for (std::size_t run = 1; run < runs.size(); ++run) {
    const std::string name = runs[run][0] + "-" + runs[run][1];
    const fs::path trace = service.directory() / (name + ".csv");
    const Evaluated evaluated =
        evaluate(service, {(state / "policies" / (name + ".json")).string(),
                           (state / "study.toml").string(), "--trace", trace.string(), "--json"});
    ASSERT_EQ(evaluated.status, 0) << evaluated.error;
    const json said = json::parse(evaluated.output);
    EXPECT_EQ(said["status"], "ok");
    EXPECT_EQ(said["task"], "swing_up");
    const double reward = said["reward"].get<double>();
    EXPECT_EQ(reward, std::stod(runs[run][4])) << name;

    const auto rows = rows_of(read_file(trace));
    ASSERT_EQ(rows.size(), 2502U) << "2.5 s in steps of a millisecond, and the names";
    EXPECT_EQ(rows[0].front(), "time_s");
    EXPECT_EQ(rows[0].back(), "cost");
    double cost_min = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < rows.size(); ++i) {
      ASSERT_EQ(rows[i].size(), rows[0].size());
      cost_min = std::min(cost_min, std::stod(rows[i].back()));
    }
    EXPECT_EQ(elementary::exp(-.25 * cost_min), reward) << name;
  }

  // What the report shows of the runs is made by the same executable.
  const fs::path report = service.directory() / "report";
  Daemon reporter("treeroll-report", {state.string(), "--output", report.string()},
                  service.directory());
  ASSERT_EQ(reporter.wait(seconds(120)), 0) << reporter.standard_error();
  EXPECT_EQ(reporter.standard_error(), "") << "where what cannot be drawn is said";
  const std::string text = read_file(report / "report.md");
  for (const char* figure : {"noise_growth", "layers", "policies", "motion"}) {
    EXPECT_THAT(text, HasSubstr(std::string("(figures/swing_up/") + figure + ".svg)"));
  }
  EXPECT_THAT(read_file(report / "figures/swing_up/policies.gp"),
              HasSubstr("'cart acceleration (m/s²)'"));
}

TEST(EvaluateTest, SaysHowAnEvaluationFails) {
  const Service service;
  const fs::path policy = service.directory() / "policy.json";
  write_file(policy, kPolicy);
  const std::string study = service.study(kSynthetic).string();
  const auto status_with = [&](const std::vector<std::string>& settings) {
    std::vector<std::string> arguments{policy.string(), study, "--json"};
    for (const std::string& setting : settings)
      arguments.insert(arguments.end(), {"--set", setting});
    const Evaluated evaluated = evaluate(service, arguments);
    EXPECT_EQ(evaluated.status, 0) << evaluated.error;
    const json said = json::parse(evaluated.output, nullptr, false);
    EXPECT_EQ(said["reward"], said["status"] == "ok" ? 1 : 0);
    return said["status"].get<std::string>();
  };
  EXPECT_EQ(status_with({}), "ok");
  EXPECT_EQ(status_with({"task.fail_fraction=1"}), "failed");
  EXPECT_EQ(status_with({"task.crash_fraction=1"}), "crashed");
  EXPECT_EQ(status_with({"task.hang_fraction=1", "task.time_limit_s=0.1"}), "timed_out");
}

TEST(EvaluateTest, PrintsLinesForAPersonWithoutJson) {
  const Service service;
  const fs::path policy = service.directory() / "policy.json";
  write_file(policy, kPolicy);
  EXPECT_EQ(evaluate(service, {policy.string(), service.study(kSynthetic).string()}).output,
            "policy  " + policy.string() + "\ntask    synthetic\nreward  1\nstatus  ok\n");
}

struct BadEvaluation {
  const char* what;
  std::string policy;                  ///< text of the policy file; empty: kPolicy
  std::string study;                   ///< text of the study; empty: kSynthetic
  std::vector<std::string> arguments;  ///< after POLICY STUDY
  std::vector<std::string> says;
};

/// Two conditions with different tasks.
std::string two_tasks() {
  return std::string(kSynthetic) + "[[conditions]]\nname = \"steep\"\ntask.sensitivity = 2.0\n";
}

class BadEvaluationTest : public ::testing::TestWithParam<BadEvaluation> {};

TEST_P(BadEvaluationTest, EndsWithStatus2AndSaysWhatIsWrong) {
  const BadEvaluation& bad = GetParam();
  const Service service;
  const fs::path policy = service.directory() / "policy.json";
  write_file(policy, bad.policy.empty() ? kPolicy : bad.policy);
  std::vector<std::string> arguments{
      policy.string(), service.study(bad.study.empty() ? kSynthetic : bad.study).string()};
  arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
  const Evaluated evaluated = evaluate(service, arguments);
  EXPECT_EQ(evaluated.status, 2) << evaluated.error;
  EXPECT_EQ(evaluated.output, "");
  for (const std::string& part : bad.says) EXPECT_THAT(evaluated.error, HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadEvaluationTest,
    ::testing::Values(
        BadEvaluation{"policy_is_no_json", "policy", "", {}, {"POLICY = ", "must be JSON"}},
        BadEvaluation{"policy_is_nested_deeply",
                      std::string(500'000, '['),
                      "",
                      {},
                      {"POLICY = ", "nested deeper"}},
        BadEvaluation{"policy_is_too_large",
                      std::string((1U << 20U) + 1, ' '),
                      "",
                      {},
                      {"POLICY = ", "is too large: must be at most 1048576 bytes"}},
        BadEvaluation{"policy_of_another_format", "{}", "", {}, {"POLICY = ", "$.format"}},
        BadEvaluation{"policy_that_is_not_utf8", "{\"\xff\": 1}", "", {}, {"POLICY = "}},
        BadEvaluation{
            "dimension_mismatch",
            "",
            "",
            {"--set", "task.input_dim=2"},
            {"POLICY = ", "has 1 inputs and 1 outputs, must have 2 inputs and 1 outputs"}},
        BadEvaluation{"unknown_condition",
                      "",
                      "",
                      {"--condition", "tree"},
                      {"--condition = tree: must be a condition of the study: plain"}},
        BadEvaluation{"ambiguous_condition",
                      "",
                      two_tasks(),
                      {},
                      {"--condition: must be given", "plain, steep"}},
        BadEvaluation{"bad_study", "", "[study\n", {}, {".toml:1"}},
        BadEvaluation{"bad_task_setting",
                      "",
                      "",
                      {"--set", "task.sensitivity=-1"},
                      {"--set: task.sensitivity = -1: must be"}},
        BadEvaluation{"unknown_task",
                      "",
                      "",
                      {"--set", "task.name=juggling"},
                      {"--set: task.name = \"juggling\": must be a task this worker knows: "}},
        BadEvaluation{"worker_program_missing",
                      "",
                      "",
                      {"--worker-program", "/nonexistent"},
                      {"--worker-program = /nonexistent: must be a program"}},
        BadEvaluation{"trace_in_no_folder",
                      "",
                      "",
                      {"--trace", "/nonexistent/trace.csv"},
                      {"--trace = /nonexistent/trace.csv: must be a file in a folder there is"}},
        BadEvaluation{"trace_is_a_folder", "", "", {"--trace", "/tmp"}, {"--trace = /tmp"}},
        BadEvaluation{"task_without_traces",
                      "",
                      "",
                      {"--trace", "trace.csv"},
                      {"--trace = trace.csv: this task records no trace"}},
        BadEvaluation{"trace_too_long",
                      "",
                      "",
                      {"--set", "task.name=swing_up", "--set", "task.plant=rk4", "--set",
                       "task.duration_s=300", "--trace", "trace.csv"},
                      {"trace: the roll-out has more than 2000000 numbers"}},
        BadEvaluation{"negative_seed", "", "", {"--seed", "-1"}, {"--seed"}},
        BadEvaluation{"unknown_option", "", "", {"--tarce", "x"}, {"--tarce"}}),
    [](const auto& test) { return test.param.what; });

TEST(BadEvaluationPathTest, AMissingPolicyAndAFolderAreRefused) {
  const Service service;
  const std::string study = service.study(kSynthetic).string();
  const Evaluated missing = evaluate(service, {"/nonexistent.json", study});
  EXPECT_EQ(missing.status, 2);
  EXPECT_THAT(missing.error, HasSubstr("POLICY = /nonexistent.json: no such file"));
  const Evaluated folder = evaluate(service, {service.directory().string(), study});
  EXPECT_EQ(folder.status, 2);
  EXPECT_THAT(folder.error, HasSubstr("is a folder, must be a policy file"));
  const Evaluated device = evaluate(service, {"/dev/zero", study});
  EXPECT_EQ(device.status, 2);
  EXPECT_THAT(device.error, HasSubstr("must be a regular file"));
}

}  // namespace
}  // namespace treeroll::end_to_end
