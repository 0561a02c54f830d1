#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "learner/fit/start_policy.h"
#include "tests/fit/read_start.h"

/// kind = "auto": what a study has decides.
namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr const char* kFile =
    R"({"kind": "auto", "demonstration": {"kind": "csv", "files": ["a.csv"], "inputs": ["t"],
        "outputs": ["x"]}})";

StartPolicy read_chosen(const std::string& text, const std::string& file = "",
                        json* resolved_out = nullptr) {
  return read_start(text, {.read_file = [&](const std::string&) { return file; }}, resolved_out);
}

TEST(AutomaticStartTest, OneRecordingIsCorrected) {
  json resolved;
  const StartPolicy start = read_chosen(R"({"kind": "auto"})", "", &resolved);
  EXPECT_EQ(start.policy->kind(), "correction");
  EXPECT_EQ(start.policy->theta_dim(), 8);
  EXPECT_EQ(resolved["kind"], "auto");
  EXPECT_EQ(read_chosen(kFile, "t,x\n0,1\n1,3\n2,0\n").policy->kind(), "correction");
}

TEST(AutomaticStartTest, WhatCannotBeCorrectedIsFittedByASpline) {
  EXPECT_EQ(read_chosen(kFile, "t,x\n0,1\n1,3\n2,0\n0,1\n1,3.1\n2,0\n").policy->kind(), "spline");
  std::string slow = "t,x\n";
  for (int n = 0; n <= 2000; ++n) {
    slow += std::to_string(n) + "," + std::to_string(n / 1000.) + "\n";
  }
  EXPECT_EQ(read_chosen(kFile, slow).policy->kind(), "spline");
}

TEST(AutomaticStartTest, AStateIsTheInputOfANetwork) {
  const StartPolicy start = read_chosen(
      R"({"kind": "auto", "demonstration": {"kind": "csv", "files": ["a.csv"],
          "inputs": ["a", "b"], "outputs": ["x"]}})",
      "a,b,x\n0,1,1\n1,3,2\n2,0,0\n3,1,-1\n1,1,2\n0,5,0\n");
  EXPECT_EQ(start.policy->kind(), "network");
  EXPECT_EQ(start.policy->input_dim(), 2);
}

/// No other kind takes a sample that lacks an output.
TEST(AutomaticStartTest, SamplesThatLackOutputsAreFittedByANetwork) {
  const StartPolicy start = read_chosen(
      R"({"kind": "auto", "hidden": 1, "demonstration": {"kind": "csv", "files": ["a.csv"],
          "inputs": ["t"], "outputs": ["x", "y"], "missing_outputs": true}})",
      "t,x,y\n0,1,2\n1,3,\n2,0,1\n3,1,0\n4,,1\n");
  EXPECT_EQ(start.policy->kind(), "network");
  EXPECT_EQ(start.policy->output_dim(), 2);
}

TEST(AutomaticStartTest, StartsFromNothing) {
  const StartPolicy path =
      read_chosen(R"({"kind": "auto", "start": "constant", "range": [0, 2], "values": [1, 2]})");
  EXPECT_EQ(path.policy->kind(), "spline");
  EXPECT_EQ(path.policy->theta_dim(), 16);
  const StartPolicy state =
      read_chosen(R"({"kind": "auto", "start": "constant", "ranges": [[0, 2], [-1, 1]]})");
  EXPECT_EQ(state.policy->kind(), "network");
}

TEST(AutomaticStartTest, ResolvesToTheSamePolicy) {
  for (const char* text : {R"({"kind": "auto"})",
                           R"({"kind": "auto", "start": "constant", "ranges": [[0, 2], [-1, 1]]})",
                           R"({"kind": "auto", "start": "constant", "range": [0, 2]})"}) {
    json resolved;
    const StartPolicy start = read_chosen(text, "", &resolved);
    EXPECT_EQ(to_json(*read_chosen(resolved.dump()).policy), to_json(*start.policy)) << text;
  }
}

TEST(AutomaticStartTest, RefusesKeysOfOtherKindsAndNoTextIsOfThisKind) {
  EXPECT_EQ(read_chosen(R"({"kind": "auto", "coefficients": [6]})").policy->theta_dim(), 6);
  try {
    read_chosen(R"({"kind": "auto", "hidden": 6})");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("policy.hidden"));
  }
  const Result<PolicyPtr> text = learnable_policies().from_json(
      R"({"format": "treeroll-policy", "version": 1, "kind": "auto"})");
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().message, HasSubstr("must be one of: correction, dmp"));
}

}  // namespace
}  // namespace treeroll
