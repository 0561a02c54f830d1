#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TreePolicy some_policy(std::uint32_t number, FrameKind kind) {
  test::RandomMixture random(number);
  const TreePolicy policy{random.tree(kind, 1, 2 + static_cast<int>(number % 3), 3), 2,
                          static_cast<ThetaLayout>(number % kThetaLayoutNames.size())};
  // Moved, so that the signs of the axes are those of a history and not the canonical ones.
  return {policy.tree_with(policy.theta() + 3 * random.vector(policy.theta_dim())),
          1 + static_cast<int>(number % 3), policy.layout()};
}

TEST(TreeJsonTest, RoundTripsToTheBit) {
  for (std::uint32_t number = 0; number < 20; ++number) {
    for (const FrameKind kind : {FrameKind::kEigenvector, FrameKind::kCholesky}) {
      const TreePolicy policy = some_policy(number, kind);
      const std::string text = to_json(policy);
      const Result<PolicyPtr> read = standard_policies().from_json(text);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(to_json(**read), text);
      const auto& copy = dynamic_cast<const TreePolicy&>(**read);
      EXPECT_EQ(copy.layer(), policy.layer());
      EXPECT_EQ(copy.layout(), policy.layout());
      test::RandomMixture random(number + 100);
      const Eigen::VectorXd theta = policy.theta() + random.vector(policy.theta_dim());
      EXPECT_EQ(test::distance(copy.decode(theta), policy.decode(theta)), 0) << number;
    }
  }
}

TEST(TreeJsonTest, SaysWhatAndWhereIsWrongWithATextFromOutside) {
  const json good = json::parse(to_json(some_policy(3, FrameKind::kEigenvector)));
  struct Case {
    const char* message;
    std::function<void(json&)> spoil;
  };
  const Case cases[] = {
      {"$.format must be", [](json& p) { p["format"] = "other"; }},
      {"$.format must be", [](json& p) { p = json::array(); }},
      {"$.version must be 1", [](json& p) { p["version"] = 2; }},
      {"$.kind must be one of: correction, dmp, ds_gmr, network, rbf, spline, tree",
       [](json& p) { p["kind"] = "polynomial"; }},
      {"$.kind must be a string", [](json& p) { p["kind"] = 1; }},
      {"$.extra is an unknown key", [](json& p) { p["extra"] = 0; }},
      {"$.layout is required", [](json& p) { p.erase("layout"); }},
      {"$.layout is 7: must be one of: means, means_cholesky, means_pourahmadi, "
       "reduced_cholesky, reduced_pourahmadi",
       [](json& p) { p["layout"] = 7; }},
      {"$.frames is \"x\"", [](json& p) { p["frames"] = "x"; }},
      {"$.layer is 4: must be an integer from 1 to 3", [](json& p) { p["layer"] = 4; }},
      {"$.layer is 0", [](json& p) { p["layer"] = 0; }},
      {"$.layer is 1.5", [](json& p) { p["layer"] = 1.5; }},
      {"$.layer is 18446744073709551615", [](json& p) { p["layer"] = 18446744073709551615U; }},
      {"$.input_dim is -1", [](json& p) { p["input_dim"] = -1; }},
      {"number of inputs is 2", [](json& p) { p["input_dim"] = 2; }},
      {"$.layers is {}", [](json& p) { p["layers"] = json::object(); }},
      {"$.layers holds 0 elements", [](json& p) { p["layers"] = json::array(); }},
      {"$.layers holds 17 elements", [](json& p) { p["layers"] = json(17, json::array()); }},
      {"$.layers[1] holds 0 elements", [](json& p) { p["layers"][1] = json::array(); }},
      {"$.layers[1] holds 5000 elements", [](json& p) { p["layers"][1] = json(5000, 0); }},
      {"$.layers[0][1] is null", [](json& p) { p["layers"][0][1] = nullptr; }},
      {"$.layers[1][2].parent is 4096", [](json& p) { p["layers"][1][2]["parent"] = 4096; }},
      {"layer 2: component 2: the parent is 2", [](json& p) { p["layers"][1][2]["parent"] = 2; }},
      {"layer 1: a component of layer 1 has no parent",
       [](json& p) { p["layers"][0][0]["parent"] = 0; }},
      {"$.layers[0][0].prior is \"1\"", [](json& p) { p["layers"][0][0]["prior"] = "1"; }},
      {"layer 1: component 0: the prior is -1", [](json& p) { p["layers"][0][0]["prior"] = -1; }},
      {"$.layers[0][0].mean[1] is null: must be a number",
       [](json& p) { p["layers"][0][0]["mean"][1] = std::nan(""); }},
      {"layer 1: component 0: element 1 of the mean is 1e+300",
       [](json& p) { p["layers"][0][0]["mean"][1] = 1e300; }},
      {"$.layers[0][0].mean holds 33 elements",
       [](json& p) { p["layers"][0][0]["mean"] = json(33, 0); }},
      {"$.layers[0][0].covariance holds 2 elements, must hold 3",
       [](json& p) { p["layers"][0][0]["covariance"].erase(0); }},
      {"$.layers[0][0].axes holds 5 elements",
       [](json& p) { p["layers"][0][0]["axes"].push_back(0); }},
      {"layer 1: component 1: the frame must be a rotation",
       [](json& p) {
         p["layers"][0][1]["axes"] = {1, 0, 0, -1};
       }},
      {"layer 1: component 1: the frame must point along",
       [](json& p) {
         p["layers"][0][1]["axes"] = {1, 0, 0, 1};
       }},
      {"layer 2: component 0: the covariance must be positive definite",
       [](json& p) {
         p["layers"][1][0]["covariance"] = {1, 2, 1};
       }},
      {"component 0: the covariance must be positive definite",
       [](json& p) {
         p["layers"][2][0]["covariance"] = {1, 2, 1};
       }},
      {"$.layers[2][0].axes is an unknown key",
       [](json& p) {
         p["layers"][2][0]["axes"] = {1, 0, 0, 1};
       }},
      {"must not be nested deeper than 6",
       [](json& p) { p["layer"] = json::parse("[[[[[[[[[[]]]]]]]]]]"); }},
  };
  ASSERT_TRUE(standard_policies().from_json(good.dump()));
  for (const Case& one : cases) {
    json spoilt = good;
    one.spoil(spoilt);
    const Result<PolicyPtr> read = standard_policies().from_json(spoilt.dump());
    ASSERT_FALSE(read) << one.message;
    EXPECT_THAT(read.error().message, HasSubstr(one.message));
    EXPECT_LT(read.error().message.size(), 300U);
  }
}

TEST(TreeJsonTest, RefusesWhatIsNoJson) {
  const std::string good = to_json(some_policy(0, FrameKind::kCholesky));
  for (const std::string& text :
       {std::string(), good.substr(0, good.size() - 1), good + "x", std::string("\xff\xfe"),
        std::string("NaN"), std::string(1 << 19, '['), "{\"format\":1e999}" + good}) {
    const Result<PolicyPtr> read = standard_policies().from_json(text);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("policy: "));
  }
  const Result<PolicyPtr> large =
      standard_policies().from_json(std::string(std::size_t{2} << 20, ' '));
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().message, HasSubstr("bytes, must have at most"));
}

}  // namespace
}  // namespace treeroll
