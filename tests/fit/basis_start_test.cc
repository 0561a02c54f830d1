#include "learner/fit/basis_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "learner/fit/demonstration.h"
#include "learner/fit/start_policy.h"
#include "tests/fit/read_start.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

double error_of(const std::string& text) {
  const StartPolicy start = read_start(text);
  return rms_error(*start.policy, *start.demonstration);
}

/// Figures of an independent implementation, m/s^2 of 5.82. Its rms is over a fine grid: over 200
/// samples, of which both ends are a larger part, .423, .163 and .087.
TEST(BasisStartTest, RadialFunctionsMeetTheSwingUpsDemonstration) {
  const auto error = [](int functions) {
    return error_of(R"({"kind": "rbf", "demonstration": {"samples": 1000}, "functions": )" +
                    std::to_string(functions) + "}");
  };
  EXPECT_NEAR(error(8), .413, .002);
  EXPECT_NEAR(error(10), .157, .002);
  EXPECT_NEAR(error(12), .083, .002);
}

TEST(BasisStartTest, MovementPrimitivesMeetTheSwingUpsDemonstration) {
  EXPECT_NEAR(error_of(R"({"kind": "dmp", "weights": 8})"), .524, .02);
  EXPECT_NEAR(error_of(R"({"kind": "dmp", "weights": 10})"), .096, .01);
  EXPECT_NEAR(error_of(R"({"kind": "dmp", "weights": 12})"), .027, .003);
  const StartPolicy start = read_start(R"({"kind": "dmp", "weights": 10})");
  EXPECT_EQ(start.policy->theta()[10], demonstrate({}).rightCols(1)(1));
  EXPECT_NEAR(start.policy->controller()->act(0), demonstrate({})(1, 0), 1e-12);
}

TEST(BasisStartTest, CountsItsFunctionsItselfAndResolvesToTheSamePolicy) {
  for (const char* kind : {"rbf", "dmp"}) {
    json resolved;
    const StartPolicy start =
        read_start(R"({"kind": ")" + std::string(kind) + R"("})", {}, &resolved);
    EXPECT_EQ(resolved[std::string(kind) == "rbf" ? "functions" : "weights"], "auto");
    EXPECT_LE(error_of(resolved.dump()), .1 * 5.83) << kind;
    const auto fewer = start.policy->theta_dim() - (std::string(kind) == "rbf" ? 1 : 2);
    EXPECT_GT(error_of(R"({"kind": ")" + std::string(kind) + "\", \"" +
                       (std::string(kind) == "rbf" ? "functions" : "weights") +
                       "\": " + std::to_string(fewer) + "}"),
              .1 * 5.81)
        << kind;
    const StartPolicy stored{.policy = start.policy->with(2 * start.policy->theta())};
    EXPECT_EQ(read_start(resolved.dump(), {.fitted = &stored}).policy, stored.policy);
  }
}

/// Another processor may have counted one more: a study that has learnt from it must go on.
TEST(BasisStartTest, AStoredStartIsTakenWhateverItsCountIfTheStudyNamesNone) {
  for (const auto& [kind, size] :
       {std::pair{"rbf", "functions"}, {"dmp", "weights"}, {"spline", "coefficients"}}) {
    const std::string begin = R"({"kind": ")" + std::string(kind) + "\"";
    const bool is_spline = std::string(kind) == "spline";
    const StartPolicy stored =
        read_start(begin + ", \"" + size + "\": " + (is_spline ? "[20]" : "20") + "}");
    EXPECT_EQ(read_start(begin + "}", {.fitted = &stored}).policy, stored.policy) << kind;
    const auto named = begin + ", \"" + size + "\": " + (is_spline ? "[19]" : "19") + "}";
    EXPECT_THROW(read_start(named, {.fitted = &stored}), ConfigError) << kind;
    const std::string longer = begin + R"(, "demonstration": {"duration_s": 3.0}})";
    EXPECT_THROW(read_start(longer, {.fitted = &stored}), ConfigError) << kind;
  }
  const StartPolicy coarse = read_start(R"({"kind": "spline", "degree": 0, "coefficients": [2]})");
  EXPECT_THROW(read_start(R"({"kind": "spline"})", {.fitted = &coarse}), ConfigError);
}

TEST(BasisStartTest, StartsFromNothing) {
  for (const char* kind : {"rbf", "dmp"}) {
    const StartPolicy start =
        read_start(R"({"start": "constant", "range": [1, 3], "values": [1, -2], "kind": ")" +
                   std::string(kind) + R"("})");
    for (const double input : {0., 1., 1.2, 3., 7.}) {
      double output[2];
      start.policy->controller()->act({&input, 1}, output);
      EXPECT_NEAR(output[0], 1, 1e-12) << kind;
      EXPECT_NEAR(output[1], -2, 1e-12) << kind;
    }
    EXPECT_EQ(start.policy->theta_dim(), std::string(kind) == "rbf" ? 16 : 22);
  }
}

TEST(BasisStartTest, RefusesWhatCannotBeUsedNamingTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"kind": "rbf", "functions": 1})", "policy.functions"},
      {R"({"kind": "rbf", "functions": 257})", "policy.functions"},
      {R"({"kind": "rbf", "functions": "many"})", "policy.functions"},
      {R"({"kind": "rbf", "weights": 8})", "policy.weights"},
      {R"({"kind": "rbf", "degree": 3})", "policy.degree"},
      {R"({"kind": "dmp", "weights": 256})", "policy.weights"},
      {R"({"kind": "dmp", "start": "constant"})", "policy.range: is required"},
      {R"({"kind": "dmp", "start": "constant", "range": [1e16, 1.0000000000000004e16]})",
       "policy.range"},
      {R"({"kind": "dmp", "start": "constant", "range": [2, 1]})", "must begin before it ends"},
      {R"({"kind": "rbf", "start": "constant", "range": [0, 5e-324]})", "by 1e-300 to 1e300"},
      {R"({"kind": "spline", "start": "constant", "range": [0, 1.7e308]})", "by 1e-300 to 1e300"},
      {R"({"kind": "rbf", "start": "constant", "range": [0, 1], "functions": "auto"})",
       "policy.functions"},
  };
  for (const auto& [text, message] : cases)
    EXPECT_THAT(refusal_of(text), HasSubstr(message)) << text;
}

}  // namespace
}  // namespace treeroll
