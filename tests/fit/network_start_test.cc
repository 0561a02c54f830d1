#include "learner/fit/network_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/policy/network/network_policy.h"
#include "learner/fit/demonstration.h"
#include "learner/fit/start_policy.h"
#include "tests/fit/read_start.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(NetworkStartTest, MeetsTheSwingUpsDemonstration) {
  const StartPolicy start = read_start(R"({"kind": "network"})");
  EXPECT_EQ(start.policy->theta_dim(), 16);
  EXPECT_LT(rms_error(*start.policy, demonstrate({})), .03);  // m/s^2 of 5.82
}

TEST(NetworkStartTest, ResolvesToTheSamePolicyAndTakesAStoredOne) {
  json resolved;
  const StartPolicy start = read_start(R"({"kind": "network", "hidden": 3})", {}, &resolved);
  EXPECT_EQ(resolved["seed"], 1);
  EXPECT_EQ(to_json(*read_start(resolved.dump()).policy), to_json(*start.policy));
  EXPECT_NE(to_json(*read_start(R"({"kind": "network", "hidden": 3, "seed": 2})").policy),
            to_json(*start.policy));
  const StartPolicy stored{.policy = start.policy->with(2 * start.policy->theta())};
  EXPECT_EQ(read_start(resolved.dump(), {.fitted = &stored}).policy, stored.policy);
  EXPECT_THROW(read_start(R"({"kind": "network"})", {.fitted = &stored}), ConfigError);
}

/// A function of two inputs, with an output that is missing here and there.
TEST(NetworkStartTest, FitsSeveralInputsAndOutputs) {
  const auto read = [](const std::string&) {
    std::string text = "a,b,x,y\n";
    for (int i = 0; i < 12; ++i) {
      for (int j = 0; j < 12; ++j) {
        const double a = i / 11. * 2 - 1, b = j * 3. - 10;
        text += std::to_string(a) + "," + std::to_string(b) + "," +
                std::to_string(5 * std::tanh(2 * a + b / 10)) + "," +
                ((i + j) % 7 == 0 ? "" : std::to_string(a - b / 20)) + "\n";
      }
    }
    return text;
  };
  const StartPolicy start = read_start(
      R"({"kind": "network", "hidden": 4, "demonstration": {"kind": "csv", "files": ["a"],
          "inputs": ["a", "b"], "outputs": ["x", "y"], "missing_outputs": true}})",
      {.read_file = read});
  const double input[] = {.3, 4};
  double output[2];
  start.policy->controller()->act(input, output);
  EXPECT_NEAR(output[0], 5 * std::tanh(1), .1);
  EXPECT_NEAR(output[1], .1, .05);
}

TEST(NetworkStartTest, StartsFromNothing) {
  const StartPolicy start = read_start(
      R"({"kind": "network", "start": "constant", "ranges": [[-1, 1], [0, 5]], "values": [2, -3]})");
  EXPECT_EQ(start.policy->input_dim(), 2);
  const double input[] = {.3, 4};
  double output[2];
  start.policy->controller()->act(input, output);
  EXPECT_EQ(output[0], 2);
  EXPECT_EQ(output[1], -3);
  // Its units turn over at different places.
  const auto& network = dynamic_cast<const NetworkPolicy&>(*start.policy).network();
  EXPECT_GT((network.inner.row(0) - network.inner.row(4)).norm(), .1);
}

TEST(NetworkStartTest, RefusesWhatCannotBeUsedNamingTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"kind": "network", "hidden": 0})", "policy.hidden"},
      {R"({"kind": "network", "hidden": 65})", "policy.hidden"},
      {R"({"kind": "network", "hidden": 64, "demonstration": {"samples": 20000}})",
       "takes too long: numbers^2 x (outputs x samples + 8/3 numbers) must be at most 200000000; "
       "take at most 32 hidden units"},
      {R"({"kind": "network", "start": "constant"})", "policy.ranges"},
      {R"({"kind": "network", "start": "constant", "ranges": [[1, 1]]})",
       "must begin before it ends"},
      {R"({"kind": "network", "components": [4]})", "policy.components"},
  };
  for (const auto& [text, message] : cases)
    EXPECT_THAT(refusal_of(text), HasSubstr(message)) << text;
}

}  // namespace
}  // namespace treeroll
