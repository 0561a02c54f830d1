#include "learner/fit/spline_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "learner/fit/demonstration.h"
#include "learner/fit/start_policy.h"
#include "tests/fit/read_start.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(SplineStartTest, FitsTheSwingUpsDemonstration) {
  const StartPolicy start = read_start(R"({"kind": "spline"})");  // as few as meet it: 8
  const Eigen::VectorXd theta = start.policy->theta();
  const double expected[] = {-5.276, -7.022, 26.666, -29.558, 21.985, -10.537, -.478, 2.170};
  ASSERT_EQ(theta.size(), 8);
  for (Eigen::Index i = 0; i < 8; ++i) EXPECT_NEAR(theta[i], expected[i], .1) << i;
  EXPECT_NEAR(rms_error(*start.policy, demonstrate({})), .343, .002);
  const auto rms_of = [](const char* coefficients) {
    return rms_error(
        *read_start(R"({"kind": "spline", "coefficients": )" + std::string(coefficients) + "}")
             .policy,
        demonstrate({}));
  };
  EXPECT_NEAR(rms_of("[10]"), .382, .002);
  EXPECT_NEAR(rms_of("[12]"), .094, .002);
  EXPECT_NEAR(rms_of("[6]"), 3.0, .05);
  EXPECT_NEAR(rms_of("[9]"), 1.06, .01);
}

TEST(SplineStartTest, ACorrectionBeginsAsTheDemonstration) {
  json resolved;
  const StartPolicy start = read_start(R"({"kind": "correction"})", {}, &resolved);
  EXPECT_EQ(start.policy->theta(), Eigen::VectorXd::Zero(8));
  EXPECT_EQ(rms_error(*start.policy, demonstrate({})), 0);
  EXPECT_EQ(resolved["coefficients"], json({8}));
  EXPECT_EQ(to_json(*read_start(resolved.dump()).policy), to_json(*start.policy));
}

TEST(SplineStartTest, StartsFromNothingWithSeveralOutputsAndLayers) {
  const StartPolicy start =
      read_start(R"({"kind": "spline", "start": "constant", "range": [0, 2], "values": [1, -2]})");
  EXPECT_EQ(start.policy->num_layers(), 4);
  EXPECT_EQ(start.policy->theta_dim(), 8);
  EXPECT_EQ(start.policy->at_layer(4)->theta_dim(), 22);
  double output[2];
  const double input = 1.2;
  start.policy->controller()->act({&input, 1}, output);
  EXPECT_NEAR(output[0], 1, 1e-15);
  EXPECT_NEAR(output[1], -2, 1e-15);
  EXPECT_EQ(start.demonstration, nullptr);
}

/// A demonstration of two outputs, at times that several recordings share.
TEST(SplineStartTest, ReadsRecordings) {
  const auto read = [](const std::string&) { return std::string("t,x,y\n0,1,5\n1,2,4\n2,0,3\n"); };
  const std::string files =
      R"("demonstration": {"kind": "csv", "files": ["a.csv"], "inputs": ["t"],
         "outputs": ["x", "y"]}})";
  const StartPolicy start = read_start(R"({"kind": "correction", )" + files, {.read_file = read});
  double output[2];
  const double input = .5;
  start.policy->controller()->act({&input, 1}, output);
  EXPECT_EQ(output[0], 1.5);
  EXPECT_EQ(output[1], 4.5);
  const std::string twice = R"({"kind": "correction", "demonstration": {"kind": "csv",
      "files": ["a.csv", "b.csv"], "inputs": ["t"], "outputs": ["x"]}})";
  EXPECT_THAT(refusal_of(twice, {.read_file = read}), HasSubstr("input 4 of the recording, 0"));
  const StartPolicy both = read_start(
      R"({"kind": "spline", "degree": 1, "coefficients": [3], )" + files, {.read_file = read});
  Eigen::VectorXd expected(6);
  expected << 1, 2, 0, 5, 4, 3;
  EXPECT_LT((both.policy->theta() - expected).norm(), 1e-7);
}

TEST(SplineStartTest, AStoredStartIsTakenIfItIsSuchAPolicy) {
  const StartPolicy eight = read_start(R"({"kind": "spline"})");
  const PolicyPtr moved = eight.policy->with(2 * eight.policy->theta());
  const StartPolicy stored{.policy = moved};
  EXPECT_EQ(read_start(R"({"kind": "spline"})", {.fitted = &stored}).policy, moved);
  EXPECT_THAT(refusal_of(R"({"kind": "spline", "coefficients": [10]})", {.fitted = &stored}),
              HasSubstr("number of coefficients"));
  EXPECT_THAT(refusal_of(R"({"kind": "correction"})", {.fitted = &stored}), HasSubstr("kind"));
}

TEST(SplineStartTest, RefusesWhatCannotBeUsedNamingTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"kind": "splines"})",
       "must be one of: auto, correction, dmp, ds_gmr, network, rbf, spline, tree"},
      {R"({"kind": "spline", "degree": 8})", "policy.degree"},
      {R"({"kind": "spline", "coefficients": [3]})", "at least 4"},
      {R"({"kind": "spline", "coefficients": [4, 6]})", "after 4 come 5"},
      {R"({"kind": "spline", "coefficients": [4.5]})", "must hold integers"},
      {R"({"kind": "spline", "coefficients": "all"})", "must be a list of numbers"},
      {R"({"kind": "spline", "coefficients": [200, 397]})", "finite number"},
      {R"({"kind": "spline", "start": "constant"})", "policy.range: is required"},
      {R"({"kind": "spline", "start": "constant", "range": [1, 1]})", "must begin before it ends"},
      {R"({"kind": "spline", "range": [0, 1]})", "policy.range"},
      {R"({"kind": "correction", "start": "fit"})", "policy.start"},
      {R"({"kind": "correction", "coefficients": "auto"})", "must be a list of numbers"},
      {R"({"kind": "correction", "demonstration": {"samples": 2001}})", "takes at most 2000"},
      {R"({"kind": "correction", "layout": "means"})", "policy.layout"},
  };
  std::string noise = "t,x\n";
  for (int n = 0; n < 300; ++n) noise += std::to_string(n) + (n % 2 == 0 ? ",1\n" : ",-1\n");
  EXPECT_THAT(refusal_of(R"({"kind": "spline", "demonstration": {"kind": "csv", "files": ["a"],
                             "inputs": ["t"], "outputs": ["x"]}})",
                         {.read_file = [&](const std::string&) { return noise; }}),
              HasSubstr("say how many there are to be"));
  for (const auto& [text, message] : cases) {
    EXPECT_THAT(refusal_of(text), HasSubstr(message)) << text;
  }
}

TEST(SplineStartTest, ADemonstrationThatLacksOutputsIsRefused) {
  const auto read = [](const std::string&) { return std::string("t,x,y\n0,1,\n1,2,3\n2,,4\n"); };
  for (const char* kind : {"spline", "correction"}) {
    EXPECT_THAT(refusal_of(R"({"demonstration": {"kind": "csv", "files": ["a"], "inputs": ["t"],
                               "outputs": ["x", "y"], "missing_outputs": true}, "kind": ")" +
                               std::string(kind) + R"("})",
                           {.read_file = read}),
                HasSubstr("must have all outputs: some are missing"));
  }
}

}  // namespace
}  // namespace treeroll
