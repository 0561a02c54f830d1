#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/worker_app/learner_stand_in.h"

/// treeroll-worker --describe-task and --evaluate with a user's program.
namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

struct Ended {
  std::optional<int> status;
  json said;
  std::string errors;
};

Ended run_worker(const std::string& mode, const json& input,
                 const std::string& program = TREEROLL_REACH) {
  Child child({mode, "--evaluator", program}, input.dump());
  const std::optional<int> status = child.wait();
  return {status, json::parse(child.output(), nullptr, false), child.errors()};
}

Ended describe(const json& settings, const std::string& program = TREEROLL_REACH) {
  return run_worker("--describe-task", {{"name", "reach"}, {"settings", settings}}, program);
}

Ended evaluate(const json& settings) {
  return run_worker("--evaluate", {{"task", {{"name", "reach"}, {"settings", settings}}},
                                   {"policy", to_json(small_policy())},
                                   {"seed", 250},
                                   {"trace", true}});
}

TEST(OffTheBusTest, DescribesWhatTheProgramDescribes) {
  const Ended ended = describe({{"goal_m", 2}});
  EXPECT_EQ(ended.status, 0) << ended.errors;
  EXPECT_EQ(ended.said["description"]["time_limit_s"], 10);
  EXPECT_EQ(ended.said["settings"]["goal_m"], 2);
  EXPECT_EQ(ended.said["settings"]["mode"], "well");
}

TEST(OffTheBusTest, SaysWhichSettingTheProgramRefuses) {
  const Ended ended = describe({{"goal_m", "x"}});
  EXPECT_EQ(ended.status, 2);
  EXPECT_EQ(ended.said["error"]["key"], "task.goal_m");
}

TEST(OffTheBusTest, AProgramThatCannotDescribeIsBadInputWithItsLastWords) {
  Ended ended = describe({{"mode", "dies_describing"}});
  EXPECT_EQ(ended.status, 2);
  EXPECT_EQ(ended.said["error"]["key"], "--evaluator");
  EXPECT_THAT(ended.said["error"]["rule"].get<std::string>(), HasSubstr("cannot describe"));
  ended = describe(json::object(), "python3 /nobody/has/this.py");
  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.said["error"]["rule"].get<std::string>(), HasSubstr("No such file"));
  for (const char* wrong : {"nobody-has-this", "/etc/passwd", "sh $TREEROLL_NOBODY_SETS_THIS"}) {
    for (const char* mode : {"--describe-task", "--evaluate"}) {
      ended = run_worker(mode, json::object(), wrong);
      EXPECT_EQ(ended.status, 2) << mode << ' ' << wrong;
      EXPECT_EQ(ended.said["error"]["key"], "--evaluator") << mode << ' ' << wrong;
    }
  }
}

TEST(OffTheBusTest, EvaluatesWithTermsAndTrace) {
  const Ended ended = evaluate({{"goal_m", .25}});
  EXPECT_EQ(ended.status, 0) << ended.errors;
  EXPECT_EQ(ended.said["evaluation"]["reward"], 1);
  EXPECT_EQ(ended.said["evaluation"]["terms"]["miss_m"], 0);
  EXPECT_EQ(ended.said["trace"]["columns"], json({"time_s", "x_m"}));
  EXPECT_EQ(ended.said["trace"]["poses"].size(), 3);
  EXPECT_EQ(evaluate({{"mode", "seed"}}).said["evaluation"]["reward"], .25);
}

TEST(OffTheBusTest, ACrashEndsItLikewiseAndAnExitIsAnAnswer) {
  EXPECT_EQ(evaluate({{"mode", "segfault"}}).status, -SIGSEGV);
  EXPECT_EQ(evaluate({{"mode", "burns"}, {"time_limit_s", .1}}).status, -SIGXCPU);
  const Ended ended = evaluate({{"mode", "exits"}});
  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.said["evaluation"]["status"], "crashed");
  EXPECT_THAT(ended.said["evaluation"]["reason"].get<std::string>(), HasSubstr("the arm is gone"));
}

}  // namespace
}  // namespace treeroll::worker
