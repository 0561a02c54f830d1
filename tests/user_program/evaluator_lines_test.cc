#include "workers/user_program/evaluator_lines.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/for_log.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

const TaskDescription kTask{.input_dim = 1, .output_dim = 1, .reward_max = 1, .time_limit_s = 1};

EvaluateAnswer read(const std::string& line) { return read_evaluate_answer(line, kTask, nullptr); }

TEST(EvaluatorLinesTest, AQuestionIsOneLineOfJson) {
  const std::string described = describe_line("a\nb", {{"goal_m", .5}});
  EXPECT_EQ(described.find('\n'), described.size() - 1);
  EXPECT_EQ(json::parse(described),
            json::parse(R"({"describe": {"name": "a\nb", "settings": {"goal_m": 0.5}}})"));

  const std::string evaluated = evaluate_line(3, -2, 18446744073709551615U, R"({"x": [1]})", true);
  EXPECT_EQ(evaluated.find('\n'), evaluated.size() - 1);
  EXPECT_EQ(json::parse(evaluated), json::parse(R"({"evaluate": {"run": 3, "rollout": -2,
      "seed": 18446744073709551615, "trace": true, "policy": {"x": [1]}}})"));
}

TEST(EvaluatorLinesTest, AnAnswerIsALineThatBeginsAsAJsonObjectWithAKey) {
  for (const char* line : {R"({"reward": 1})", R"({"reward": NaN})", R"({"cut)", "{}", "{ }",
                           R"({ "reward": NaN})", R"( {"reward": 1})"}) {
    EXPECT_TRUE(is_answer(line)) << line;
  }
  for (const char* line :
       {"", "episode 3", "[1]", "{'reward': 1}", "{not json", "  {\"cut", "null", "{}{}"}) {
    EXPECT_FALSE(is_answer(line)) << line;
  }
}

TEST(EvaluatorLinesTest, ALineForTheLogHoldsNothingThatATerminalObeys) {
  EXPECT_EQ(for_log("a\x1b[2Jb\rc\td\x7f"), "a [2Jb c d ");
  EXPECT_EQ(for_log("\xc2\x9b"
                    "2J \xc3\xa4"),
            " 2J \xc3\xa4");
  EXPECT_THAT(for_log("\xff"), Not(HasSubstr("\xff")));
  EXPECT_LE(for_log(std::string(100'000, 'x')).size(), 1000);
}

TEST(EvaluatorLinesTest, ReadsADescriptionWithAndWithoutSettings) {
  const std::string facts = R"("input_dim": 2, "output_dim": 1, "reward_min": 0, "reward_max": 3,
      "time_limit_s": 4, "deterministic": false)";
  auto answer = read_describe_answer("{" + facts + R"(, "settings": {"a": 1}, "version": "7"})");
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->description.input_dim, 2);
  EXPECT_EQ(answer->description.version, "7");
  EXPECT_FALSE(answer->description.deterministic);
  EXPECT_EQ(answer->settings, R"({"a":1})");
  EXPECT_FALSE(answer->refusal);
  answer = read_describe_answer("{" + facts + "}");
  ASSERT_TRUE(answer);
  EXPECT_FALSE(answer->settings);
  answer = read_describe_answer(R"({"refused": "goal_m: must\nbe \u001b positive"})");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->refusal, "goal_m: must be   positive");
}

TEST(EvaluatorLinesTest, RefusesWhatIsNoDescription) {
  for (
      const char* line :
      {"{}", "{\"input_dim\": 1", R"({"refused": 3})", R"({"refused": "a", "input_dim": 1})",
       R"({"input_dim": 0, "output_dim": 1, "reward_min": 0, "reward_max": 3, "time_limit_s": 4, "deterministic": true})",
       R"({"input_dim": 1, "output_dim": 1, "reward_min": 0, "reward_max": 3, "time_limit_s": 4, "deterministic": true, "more": 1})",
       R"({"input_dim": 1, "output_dim": 1, "reward_min": 0, "reward_max": 3, "time_limit_s": 4, "deterministic": true, "settings": []})"}) {
    EXPECT_FALSE(read_describe_answer(line)) << line;
  }
}

TEST(EvaluatorLinesTest, ReadsRewardFailureAndDiscard) {
  const EvaluateAnswer answer = read(R"({"reward": 0.83, "terms": {"effort": 0.2, "lost": null}})");
  EXPECT_EQ(answer.outcome, Outcome::ok(.83));
  EXPECT_EQ(answer.terms.at("effort"), .2);
  EXPECT_TRUE(std::isnan(answer.terms.at("lost")));
  EXPECT_EQ(read(R"({"failed": "arm hit the table"})").outcome,
            Outcome::failed(RolloutStatus::kFailed, "arm hit the table"));
  EXPECT_EQ(read(R"({"discarded": "operator"})").outcome, Outcome::discarded("operator"));
  EXPECT_LE(read(R"({"failed": ")" + std::string(5000, 'x') + "\"}").outcome.reason().size(),
            kOutcomeReasonBytesMax);
}

TEST(EvaluatorLinesTest, WhatIsNoAnswerFailsTheRolloutAndNamesTheRule) {
  const auto reason = [](const std::string& line) {
    const Outcome outcome = read(line).outcome;
    EXPECT_EQ(outcome.status(), RolloutStatus::kFailed) << line;
    return outcome.reason();
  };
  EXPECT_THAT(reason(R"({"reward": NaN})"), HasSubstr("must be JSON"));
  EXPECT_THAT(reason("{}"), HasSubstr("one of"));
  EXPECT_THAT(reason(R"({"reward": 1, "failed": "x"})"), HasSubstr("one of"));
  EXPECT_THAT(reason(R"({"reward": "1"})"), HasSubstr("number"));
  EXPECT_THAT(reason(R"({"reward": null})"), HasSubstr("number"));
  EXPECT_THAT(reason(R"({"reward": 1.5})"), HasSubstr("outside its range 0 .. 1"));
  EXPECT_THAT(reason(R"({"reward": -1e-300})"), HasSubstr("outside its range"));
  EXPECT_THAT(reason(R"({"reward": 1, "rewrad": 1})"), HasSubstr("'rewrad'"));
  EXPECT_THAT(reason(R"({"reward": 1, "terms": {"a": "b"}})"), HasSubstr("'terms'"));
  EXPECT_THAT(reason(R"({"reward": 1, "terms": {"": 1}})"), HasSubstr("name of a term"));
  EXPECT_THAT(reason(R"({"reward": 1, "terms": {")" + std::string(65, 'x') + R"(": 1}})"),
              HasSubstr("must have 1 to 64 bytes"));
  EXPECT_THAT(reason(R"({"failed": 1})"), HasSubstr("string"));
}

TEST(EvaluatorLinesTest, ReadsATrace) {
  Trace trace;
  const EvaluateAnswer answer = read_evaluate_answer(
      R"({"reward": 1, "trace": {"columns": ["t", "x"], "rows": [[0, 1], [1, null]],
          "policy_inputs": ["t"], "policy_outputs": ["x"], "poses": [[[0, 1, 2, 3]], []]}})",
      kTask, &trace);
  EXPECT_TRUE(answer.outcome.is_ok()) << answer.outcome.reason();
  EXPECT_THAT(trace.columns(), ElementsAre("t", "x"));
  ASSERT_EQ(trace.numbers().size(), 4);
  EXPECT_TRUE(std::isnan(trace.numbers()[3]));
  EXPECT_THAT(trace.policy_outputs(), ElementsAre("x"));
  ASSERT_EQ(trace.poses().size(), 2);
  EXPECT_EQ(trace.poses()[0][0][1].y_m, 3);
}

TEST(EvaluatorLinesTest, ATraceThatBreaksARuleFailsTheRollout) {
  for (const char* trace :
       {"3", "{}", R"({"columns": [], "rows": []})", R"({"columns": ["t"], "rows": [[1, 2]]})",
        R"({"columns": ["t"], "rows": [["a"]]})", R"({"columns": [1], "rows": []})",
        R"({"columns": ["t"], "rows": [], "policy_inputs": ["x"]})",
        R"({"columns": ["t"], "rows": [[1]], "poses": [[], []]})",
        R"({"columns": ["t"], "rows": [[1]], "poses": [[[1]]]})",
        R"({"columns": ["t"], "rows": [[1]], "poses": [3]})",
        R"({"columns": ["t"], "rows": [], "more": 1})"}) {
    Trace read;
    const EvaluateAnswer answer =
        read_evaluate_answer(std::string(R"({"reward": 1, "trace": )") + trace + "}", kTask, &read);
    EXPECT_EQ(answer.outcome.status(), RolloutStatus::kFailed) << trace;
  }
}

}  // namespace
}  // namespace treeroll::worker
