#include "learner/fit/component_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/policy/policy.h"
#include "learner/fit/start_policy.h"
#include "tests/fit/start_tree.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The start of experiment I, thesis section 4-1.
const std::string kExperiment = R"("start": "components", "layout": "means",
    "layer_1": {"range": [0, 2], "outputs": [0, 0], "deviations": [0.35355339, 0.3]},
    "layer_2": {"range": [0, 2], "outputs": [0, 0, 0, 0], "deviations": [0.25, 0.3],
                "parents": [1, 1, 2, 2]})";

StartPolicy read_keys(const std::string& keys, json* resolved_out = nullptr) {
  return read_start_tree("{" + keys + "}", resolved_out);
}

std::string refusal_of_keys(const std::string& keys) {
  return refusal_of_start_tree("{" + keys + "}");
}

TEST(ComponentLayersTest, BuildsTheTreeOfTheFirstExperiment) {
  const StartPolicy start = read_keys(kExperiment);
  EXPECT_EQ(tree_policy(start).layout(), ThetaLayout::kMeans);
  ASSERT_EQ(tree_of(start).num_layers(), 2);
  EXPECT_THAT(tree_of(start).parents(2), ElementsAre(0, 0, 1, 1));
  for (int k = 0; k < 4; ++k) {
    const Component component = tree_of(start).finest()[k];
    EXPECT_NEAR(component.mean[0], (k + .5) * 2 / 4, 1e-15);
    EXPECT_NEAR(component.mean[1], 0, 1e-15);
    EXPECT_NEAR(component.prior, .25, 1e-15);
    EXPECT_LT(
        (component.covariance - Eigen::Matrix2d(Eigen::Vector2d(.0625, .09).asDiagonal())).norm(),
        1e-15);
  }
  EXPECT_NEAR(tree_of(start).layer(1)[1].mean[0], 1.5, 1e-15);
  EXPECT_NEAR(tree_of(start).layer(1)[1].covariance(0, 0), .125, 1e-8);
}

TEST(ComponentLayersTest, AFlatModelIsTheFinestLayer) {
  const StartPolicy tree = read_keys(kExperiment);
  const StartPolicy flat = read_keys(kExperiment + R"(, "model": "flat")");
  EXPECT_EQ(tree_of(flat).num_layers(), 1);
  EXPECT_EQ(test::distance(tree_of(flat).finest(), tree_of(tree).finest()), 0);
}

TEST(ComponentLayersTest, TakesAnyDimensionsAndAnyNumberOfChildren) {
  const StartPolicy start = read_keys(R"("start": "components", "frames": "cholesky",
      "layer_1": {"inputs": 2, "means": [[0, 0, 1]], "deviations": [1, 2, 3]},
      "layer_2": {"inputs": 2, "means": [[0, 0, 1], [1, 1, 1], [2, 2, 2]],
                  "covariances": [[1, 0, 1, 0, 0, 1]], "parents": [1, 1, 1]},
      "layer_3": {"inputs": 2, "means": [[0, 0, 5]], "deviations": [1, 1, 1], "parents": [3]})");
  EXPECT_EQ(tree_of(start).frame_kind(), FrameKind::kCholesky);
  EXPECT_EQ(tree_of(start).num_layers(), 3);
  EXPECT_EQ(tree_of(start).input_dim(), 2);
  EXPECT_NEAR(tree_of(start).finest()[0].mean[2], 5, 1e-14);
}

TEST(ComponentLayersTest, ResolvesToSettingsThatGiveTheSamePolicy) {
  json resolved;
  const StartPolicy start = read_keys(kExperiment, &resolved);
  const std::string text = resolved.dump();
  const StartPolicy again = read_keys(text.substr(1, text.size() - 2));
  EXPECT_EQ(to_json(*again.policy), to_json(*start.policy));
}

TEST(ComponentLayersTest, RefusesWhatIsNoTreeNamingTheKey) {
  const std::string components = R"("start": "components", )";
  const std::string layer_1 = R"("layer_1": {"means": [[0, 0]], "deviations": [1, 1]})";
  const std::pair<std::string, const char*> cases[] = {
      {R"("start": "guess")", "policy.start"},
      {R"("start": "components")", "policy.layer_1.means: is required"},
      {components + R"("layer_1": 3)", "policy.layer_1 = 3: must be a table"},
      {components + R"("model": "top_down_tree", )" + layer_1, "policy.model"},
      {components + R"("fit": {}, )" + layer_1, "policy.fit"},
      {components + R"("layer_3": {}, )" + layer_1, "policy.layer_3"},
      {components + R"("layer_1": {"means": [[0, 0]], "deviations": [1, 1], "parents": [1]})",
       "policy.layer_1.parents"},
      {components + layer_1 + R"(, "layer_2": {"means": [[0, 0]], "deviations": [1, 1]})",
       "policy.layer_2.parents: is required"},
      {components + layer_1 +
           R"(, "layer_2": {"means": [[0, 0]], "deviations": [1, 1], "parents": [2]})",
       "policy.layer_2.parents"},
      {components + layer_1 +
           R"(, "layer_2": {"means": [[0, 0]], "deviations": [1, 1], "parents": [0.5]})",
       "policy.layer_2.parents"},
      {components + layer_1 +
           R"(, "layer_2": {"means": [[0, 0]], "deviations": [1, 1], "parents": [1, 1]})",
       "must hold 1 numbers"},
      {components + layer_1 +
           R"(, "layer_2": {"means": [[0, 0, 0]], "deviations": [1, 1, 1], "parents": [1]})",
       "gives no tree"},
  };
  for (const auto& [keys, message] : cases) {
    EXPECT_THAT(refusal_of_keys(keys), HasSubstr(message)) << keys;
  }
}

}  // namespace
}  // namespace treeroll
