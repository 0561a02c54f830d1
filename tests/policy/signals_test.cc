// What a policy's text calls inputs and outputs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/policy_registry.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// Of a kind whose own text has keys of such names as well.
constexpr const char* kCorrection =
    R"({"format": "treeroll-policy", "version": 1, "kind": "correction", "degree": 1,
        "range": [0, 2], "sizes": [2], "layer": 1, "coefficients": [[1, 2]],
        "inputs": [0, 1, 2], "outputs": [[0.1, 5, -3]]})";
const SignalNames kNames{{"time_s"}, {"cart_acceleration_mps2"}};

std::string error_with_signals(const json& signals) {
  json text = json::parse(kCorrection);
  text["signals"] = signals;
  const auto read = standard_policies().named_from_json(text.dump());
  return read ? "" : read.error().message;
}

TEST(SignalsTest, GoRoundWithThePolicysText) {
  const PolicyRegistry kinds = standard_policies();
  const auto plain = kinds.named_from_json(kCorrection);
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_TRUE(plain->signals.empty());
  const std::string text = to_json(*plain->policy, kNames);
  const auto named = kinds.named_from_json(text);
  ASSERT_TRUE(named) << named.error().message;
  EXPECT_EQ(named->signals, kNames);
  EXPECT_EQ(to_json(*named->policy, named->signals), text);
}

/// Old readers of old texts, journals and workers: nothing of it has changed.
TEST(SignalsTest, AreOneKeyMoreAndNothingElse) {
  const Result<PolicyPtr> policy = standard_policies().from_json(kCorrection);
  ASSERT_TRUE(policy);
  json named = json::parse(to_json(**policy, kNames));
  EXPECT_EQ(named.erase("signals"), 1U);
  EXPECT_EQ(named.dump(), to_json(**policy));
  EXPECT_EQ(to_json(**policy, {}), to_json(**policy));
  const Result<PolicyPtr> again = standard_policies().from_json(to_json(**policy, kNames));
  ASSERT_TRUE(again) << "who wants no names reads it as well";
  EXPECT_EQ(to_json(**again), to_json(**policy));
}

TEST(SignalsTest, ThatFitNoPolicyAreRefusedWithTheRule) {
  EXPECT_EQ(error_with_signals({{"inputs", {"time_s"}}, {"outputs", {"u"}}}), "");
  EXPECT_THAT(error_with_signals({{"inputs", {"time_s"}}}),
              HasSubstr("$.signals.outputs is required"));
  EXPECT_THAT(error_with_signals({{"inputs", {"a", "b"}}, {"outputs", {"u"}}}),
              HasSubstr("$.signals are wrong: inputs: has 2 names, must have 1"));
  EXPECT_THAT(error_with_signals({{"inputs", {3}}, {"outputs", {"u"}}}),
              HasSubstr("$.signals.inputs[0] is 3: must be a string"));
  EXPECT_THAT(error_with_signals({{"inputs", json::array()}, {"outputs", json::array()}}),
              HasSubstr("$.signals must name inputs and outputs"));
  EXPECT_THAT(error_with_signals({{"inputs", {"t"}}, {"outputs", {"u"}}, {"units", {"s"}}}),
              HasSubstr("$.signals.units is an unknown key"));
  EXPECT_THAT(error_with_signals(nullptr), HasSubstr("$.signals is null: must be an object"));
}

}  // namespace
}  // namespace treeroll
