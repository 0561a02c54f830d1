#include <gmock/gmock.h>

#include <csignal>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tests/worker_app/child.h"
#include "workers/app/json_answer.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// One component with its mean at the synthetic task's target: reward 1.
json policy() {
  return json::parse(R"({"format": "treeroll-policy", "version": 1, "frames": "eigenvector",
    "layout": "means", "input_dim": 1, "layer": 1, "layers": [[
    {"parent": -1, "prior": 1, "mean": [1, 1], "covariance": [1, 1, 2]}]]})");
}

json request(const json& task_settings = json::object()) {
  return {{"task", {{"name", "synthetic"}, {"settings", task_settings}}},
          {"policy", policy().dump()}};
}

struct Answer {
  std::optional<int> status;
  json said;
};

Answer ask_worker(const std::string& input) {
  Child child({"--evaluate"}, input);
  const std::optional<int> status = child.wait();
  return {status, json::parse(child.output(), nullptr, false)};
}

/// What it says of an evaluation but how long that took, which is some time.
json but_duration(json evaluation) {
  EXPECT_GE(evaluation["duration_s"].get<double>(), 0);
  evaluation.erase("duration_s");
  return evaluation;
}

TEST(EvaluatePolicyTest, SaysRewardStatusAndDescription) {
  const Answer outcome = ask_worker(request().dump());
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(but_duration(outcome.said["evaluation"]),
            (json{{"reason", ""}, {"reward", 1}, {"status", "ok"}}));
  EXPECT_EQ(outcome.said["evaluation"]["reason"], "");
  EXPECT_EQ(outcome.said["description"]["input_dim"], 1);
  EXPECT_FALSE(outcome.said.contains("trace"));
}

TEST(EvaluatePolicyTest, TheSeedDecidesWhereATaskIsNotDeterministic) {
  json asked = request({{"noise_deviation", .1}, {"target", {3, 3, 1}}});
  const auto reward = [&](int seed) {
    asked["seed"] = seed;
    return ask_worker(asked.dump()).said["evaluation"]["reward"];
  };
  EXPECT_EQ(reward(1), reward(1));
  EXPECT_NE(reward(1), reward(2));
}

TEST(EvaluatePolicyTest, ATaskWithoutTracesGivesAnEmptyOne) {
  json asked = request();
  asked["trace"] = true;
  const json said = ask_worker(asked.dump()).said;
  EXPECT_EQ(said["trace"], (json{{"columns", json::array()},
                                 {"numbers", json::array()},
                                 {"policy_inputs", json::array()},
                                 {"policy_outputs", json::array()},
                                 {"poses", json::array()}}));
}

TEST(EvaluatePolicyTest, ATraceHasThePolicysColumnsAndWhatIsSeenAtEachRow) {
  const json asked{{"task", {{"name", "swing_up"}, {"settings", {{"duration_s", .01}}}}},
                   {"policy", policy().dump()},
                   {"trace", true}};
  const json trace = ask_worker(asked.dump()).said["trace"];
  EXPECT_EQ(trace["policy_inputs"], json{"time_s"});
  EXPECT_EQ(trace["policy_outputs"], json{"cart_acceleration_mps2"});
  EXPECT_EQ(trace["poses"].size() * trace["columns"].size(), trace["numbers"].size());
  const json& hanging = trace["poses"][0];
  ASSERT_EQ(hanging.size(), 2);  // the cart; the links: joint, joint, tip
  ASSERT_EQ(hanging[1].size(), 6);
  EXPECT_EQ(hanging[1][1], 0);
  EXPECT_NEAR(hanging[1][5].get<double>(), -.803, 1e-9);
}

TEST(EvaluatePolicyTest, AFailureIsAnAnswerAndATaskPastItsTimeIsEnded) {
  const Answer failed = ask_worker(request({{"fail_fraction", 1}}).dump());
  EXPECT_EQ(failed.status, 0);
  EXPECT_EQ(
      but_duration(failed.said["evaluation"]),
      (json{
          {"reason", "its policy is one of fail_fraction"}, {"reward", 0}, {"status", "failed"}}));
  EXPECT_EQ(ask_worker(request({{"crash_fraction", 1}}).dump()).status, -SIGSEGV);
  EXPECT_EQ(ask_worker(request({{"hang_fraction", 1}, {"time_limit_s", .1}}).dump()).status,
            -SIGXCPU);
}

TEST(EvaluatePolicyTest, BadRequestsAreRefusedWithKeyAndRule) {
  struct Bad {
    const char* key;
    std::string request;
    const char* rule;
  };
  const auto with = [](const char* key, const json& value) {
    json changed = request();
    changed[key] = value;
    return changed.dump();
  };
  const auto with_policy = [&](const char* key, const json& value) {
    json changed = policy();
    changed[key] = value;
    return with("policy", changed.dump());
  };
  const std::string deep(100'000, '[');
  for (const Bad& bad : std::vector<Bad>{
           {"request", "", "must be JSON"},
           {"request", "[1]", "must be a JSON object"},
           {"request", R"({"policy": ""})", "must be a JSON object"},
           {"request", deep, "nested deeper"},
           {"request", R"({"task": )" + deep, "nested deeper"},
           {"request", std::string((4U << 20U) + 1, ' '), "bytes long"},
           {"request.polcy", with("polcy", 1), "unknown key"},
           {"request.policy", with("policy", 3), "must be a string"},
           {"request.seed", with("seed", 0.5), "must be an integer"},
           {"request.trace", with("trace", 1), "must be"},
           {"task", with("task", 3), "must be a JSON object"},
           {"task.name", with("task", {{"name", "nobody"}, {"settings", json::object()}}),
            "must be a task this worker knows"},
           {"policy", with("policy", "{}"), "$.format"},
           {"policy", with("policy", deep), "nested deeper"},
           {"policy", with_policy("version", 2), "$.version"},
           {"policy", with_policy("layer", 2), "$.layer"},
           {"policy", with_policy("input_dim", 2), "layers"},
           {"policy", with("task", {{"name", "synthetic"}, {"settings", {{"input_dim", 2}}}}),
            "has 1 inputs and 1 outputs, must have 2 inputs and 1 outputs"},
       }) {
    const Answer outcome = ask_worker(bad.request);
    EXPECT_EQ(outcome.status, 2) << bad.request.substr(0, 300);
    EXPECT_EQ(outcome.said["error"]["key"], bad.key) << outcome.said;
    EXPECT_THAT(outcome.said["error"]["rule"].get<std::string>(), HasSubstr(bad.rule));
  }
}

TEST(JsonAnswerTest, WhatATaskPrintsDoesNotReachTheAnswer) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  {
    const JsonAnswer answer;
    std::cout << "simulating";
    std::puts(" ...");
    EXPECT_EQ(answer.give({{"reward", 1}}), 0);
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "{\"reward\":1}\n");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("simulating"));
}

}  // namespace
}  // namespace treeroll::worker
