#include "workers/check_evaluator/conformance.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/program/program_command.h"
#include "tests/worker_app/learner_stand_in.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using Verdict = Finding::Verdict;

std::vector<Finding> check(const json& settings, const std::string& policy = "",
                           const std::string& command = TREEROLL_REACH) {
  return check_evaluator({.program = {command, read_program_command("CMD", command)},
                          .task = "reach",
                          .settings = settings.dump(),
                          .policy = policy,
                          .answer_limit = std::chrono::seconds(20),
                          .log = [](const std::string&, const std::string&) {}});
}

/// The rules that are broken, or not followed.
std::vector<int> rules_with(Verdict verdict, const std::vector<Finding>& findings) {
  std::vector<int> rules;
  for (const Finding& finding : findings) {
    if (finding.verdict == verdict) rules.push_back(finding.rule);
  }
  return rules;
}

TEST(ConformanceTest, AProgramThatKeepsAllRulesPassesEach) {
  for (const char* mode : {"well", "seed", "chatty"}) {
    const std::vector<Finding> findings = check({{"mode", mode}});
    EXPECT_EQ(findings.size(), 15) << mode;
    for (const Finding& finding : findings) {
      EXPECT_EQ(finding.verdict, Verdict::kKept) << mode << ' ' << finding.rule << finding.what;
    }
  }
}

TEST(ConformanceTest, NamesTheRuleThatIsBroken) {
  const std::vector<std::pair<const char*, int>> cases = {{"describes_nonsense", 8},
                                                          {"dies_describing", 18},
                                                          {"nan", 13},
                                                          {"nothing", 13},
                                                          {"unknown_key", 13},
                                                          {"twice", 6},
                                                          {"exits", 18},
                                                          {"long_line", 7},
                                                          {"bad_trace", 16},
                                                          {"forgets_itself", 14},
                                                          {"names_matter", 12},
                                                          {"signed_seed", 12},
                                                          {"small_seeds", 12},
                                                          {"ignores_end", 20},
                                                          {"refuses_more", 4},
                                                          {"defaults_drift", 9}};
  for (const auto& [mode, rule] : cases) {
    EXPECT_THAT(rules_with(Verdict::kBroken, check({{"mode", mode}})), Contains(rule)) << mode;
  }
}

TEST(ConformanceTest, AdvisesWhatIsNoMust) {
  EXPECT_THAT(rules_with(Verdict::kAdvised, check({{"mode", "takes_anything"}})), Contains(10));
  EXPECT_THAT(rules_with(Verdict::kAdvised, check({{"mode", "no_trace"}})), Contains(16));
  const std::vector<Finding> by_chance = check({{"mode", "fails_by_chance"}});
  EXPECT_THAT(rules_with(Verdict::kAdvised, by_chance), Contains(12)) << "no fault of the seed";
  EXPECT_THAT(rules_with(Verdict::kBroken, by_chance), IsEmpty());
}

TEST(ConformanceTest, FailuresAreNotTakenForEqualRewards) {
  const std::vector<Finding> findings = check({{"mode", "failed"}});
  EXPECT_THAT(rules_with(Verdict::kUndecided, findings), ElementsAre(13));
  EXPECT_THAT(rules_with(Verdict::kKept, findings), ElementsAre(8, 9, 10, 6, 20, 17));
}

TEST(ConformanceTest, ComparesWhatGetsAReward) {
  const std::vector<Finding> of_another_policy = check({{"mode", "fails_above"}});
  for (const Finding& finding : of_another_policy) {
    EXPECT_NE(finding.verdict, Verdict::kUndecided) << finding.what;
  }
  EXPECT_THAT(rules_with(Verdict::kKept, of_another_policy), IsSupersetOf({12, 14, 16, 4}));
  const std::vector<Finding> after_a_void_trial = check({{"mode", "discards_first"}});
  EXPECT_THAT(rules_with(Verdict::kBroken, after_a_void_trial), IsEmpty());
  EXPECT_THAT(rules_with(Verdict::kNotTried, after_a_void_trial), Not(IsEmpty()))
      << "what is void says nothing";
}

TEST(ConformanceTest, WhatComesAsItComesIsNotHeldToBeEqual) {
  const std::vector<Finding> findings = check({{"mode", "as_it_comes"}});
  EXPECT_THAT(rules_with(Verdict::kAdvised, findings), ElementsAre(14));
  EXPECT_THAT(rules_with(Verdict::kBroken, findings), IsEmpty());
}

TEST(ConformanceTest, ATaskOfTooShortATimeLimitIsFound) {
  for (const char* mode : {"burns_a_while", "waits"}) {
    const double limit_s = mode == std::string("waits") ? .05 : .5;
    const std::vector<Finding> findings = check({{"mode", mode}, {"time_limit_s", limit_s}});
    EXPECT_THAT(rules_with(Verdict::kBroken, findings), ElementsAre(17)) << mode;
  }
}

TEST(ConformanceTest, AnEvaluationHasTheTimeThatItsDescriptionSays) {
  ConformanceRun run{.program = {TREEROLL_REACH, read_program_command("CMD", TREEROLL_REACH)},
                     .task = "reach",
                     .settings = R"({"mode": "waits"})",
                     .policy = to_json(small_policy()),
                     .answer_limit = std::chrono::seconds(4),
                     .log = [](const std::string&, const std::string&) {}};
  EXPECT_THAT(rules_with(Verdict::kBroken, check_evaluator(run)), IsEmpty());
}

TEST(ConformanceTest, TakesAPolicyOfTheUsers) {
  EXPECT_THAT(rules_with(Verdict::kBroken, check(json::object(), to_json(small_policy()))),
              IsEmpty());
  EXPECT_THROW(check(json::object(), "{}"), ConfigError);
}

TEST(ConformanceTest, MovesNoRobotUnlessItIsToldToAndBy) {
  ConformanceRun run{.program = {TREEROLL_REACH, read_program_command("CMD", TREEROLL_REACH)},
                     .task = "reach",
                     .settings = R"({"mode": "not_repeatable"})",
                     .policy = {},
                     .answer_limit = std::chrono::seconds(20),
                     .log = {}};
  int num_moves = 0;
  run.log = [&](const std::string&, const std::string& line) { num_moves += line == "moves"; };
  for (const bool moves : {false, true}) {
    run.moves = moves;  // by which policy is not said
    const std::vector<Finding> findings = check_evaluator(run);
    EXPECT_THAT(rules_with(Verdict::kNotTried, findings), Contains(13));
    EXPECT_THAT(rules_with(Verdict::kKept, findings), ElementsAre(8, 9, 10, 20));
    EXPECT_EQ(num_moves, 0);
  }
  run.policy = to_json(small_policy());
  EXPECT_THAT(rules_with(Verdict::kNotTried, check_evaluator(run)), IsEmpty());
  EXPECT_GT(num_moves, 0);
  run.moves = false;
  num_moves = 0;
  check_evaluator(run);
  EXPECT_EQ(num_moves, 0);
}

TEST(ConformanceTest, AProgramThatIsNoneBreaksRules) {
  EXPECT_THAT(rules_with(Verdict::kBroken, check(json::object(), "", "true")), Contains(18));
  EXPECT_THAT(rules_with(Verdict::kBroken, check(json::object(), "", "cat")), Contains(8));
}

}  // namespace
}  // namespace treeroll::worker
