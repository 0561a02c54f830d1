#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <set>
#include <sstream>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/policy_bounds.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"
#include "tests/worker_app/child.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What the C program says to these lines.
std::vector<std::string> c_says(const std::string& input) {
  worker::Child program({}, input, TREEROLL_ACTS);
  EXPECT_EQ(program.wait(), 0) << program.errors();
  return lines_of(program.output());
}

std::string hex(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    char one[64];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(one, sizeof one, "%a", number);
    text += (text.empty() ? "" : " ") + std::string(one);
  }
  return text;
}

/// The library takes the policy's text, a theta near its own, and 50 inputs.
void expect_same_bits(const Policy& start, test::RandomMixture& random) {
  Eigen::VectorXd theta = start.theta();
  for (double& x : theta) x += 1e-3 * random.normal();
  const PolicyPtr changed = start.with(theta);
  const auto controller = changed->controller();
  std::string input = to_json(start) + "\nget\ntheta " +
                      hex({theta.data(), static_cast<std::size_t>(theta.size())}) + "\ntext\n";
  std::vector<std::string> expected;
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd point = 3 * random.vector(start.input_dim());
    const std::span<const double> numbers(point.data(), static_cast<std::size_t>(point.size()));
    std::vector<double> output(static_cast<std::size_t>(start.output_dim()));
    controller->act(numbers, output);
    input += "act " + hex(numbers) + "\n";
    expected.push_back(hex(output));
  }
  const std::vector<std::string> said = c_says(input);
  ASSERT_EQ(said.size(), expected.size() + 4);
  const Eigen::VectorXd start_theta = start.theta();
  EXPECT_EQ(said[1], hex({start_theta.data(), static_cast<std::size_t>(start_theta.size())}));
  EXPECT_EQ(said[2], to_json(*changed));
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(said[i + 3], expected[i]) << i;
  EXPECT_EQ(said.back(), "0 wrong calls were taken");
}

TEST(PolicyLibraryTest, ActsToTheSameBitsAsTheClasses) {
  int number = 0;
  for (const ThetaLayout layout : kLayouts) {
    for (const auto& [input_dim, output_dim] : {std::pair(1, 1), {2, 3}}) {
      SCOPED_TRACE(number);
      test::RandomMixture random(static_cast<std::uint32_t>(++number));
      const TreePolicy start(
          random.tree(FrameKind::kCholesky, input_dim, input_dim + output_dim, 2), 2, layout);
      expect_same_bits(start, random);
    }
  }
}

TEST(PolicyLibraryTest, KnowsEveryKind) {
  const char* contents[] = {
      R"("kind": "spline", "degree": 2, "range": [0, 2], "sizes": [3, 4], "layer": 2,
         "coefficients": [[1, 2, -3, 0.5], [4, 0, 1, 2]])",
      R"("kind": "correction", "degree": 1, "range": [0, 2], "sizes": [2], "layer": 1,
         "coefficients": [[1, 2]], "inputs": [0, 1, 2], "outputs": [[0.1, 5, -3]])",
      R"("kind": "rbf", "range": [0, 2], "layer": 1, "coefficients": [[1, 2, -3], [4, 0, 1]])",
      R"("kind": "dmp", "range": [0, 2], "layer": 1, "starts": [1.5],
         "coefficients": [[1, 2, -3, 0.5]])",
      R"("kind": "ds_gmr", "range": [0, 2], "stiffness": 100, "attractor": {"frames": "cholesky",
         "input_dim": 1, "layer": 1, "layout": "means", "layers": [[{"parent": -1, "prior": 1,
         "mean": [1, 2], "covariance": [0.5, 0.3, 1]}]]})",
      R"("kind": "network", "ranges": [[-1, 1], [0, 3]], "outer": [[1, 2, 0.5]],
         "inner": [[1, -1, 0.3], [0.2, 2, -1]])"};
  test::RandomMixture random(99);
  for (const char* content : contents) {
    std::string text = R"({"format": "treeroll-policy", "version": 1, )" + std::string(content);
    const Result<PolicyPtr> policy = standard_policies().from_json(text + "}");
    ASSERT_TRUE(policy) << policy.error().message;
    SCOPED_TRACE(std::string((*policy)->kind()));
    expect_same_bits(**policy, random);
  }
}

TEST(PolicyLibraryTest, SaysWhatInputsAndOutputsAreCalled) {
  test::RandomMixture random(1);
  const TreePolicy policy(TreeModel::from_global(FrameKind::kCholesky, {random.gmm(2, 3, 1)}, {{}}),
                          1, ThetaLayout::kMeans);
  ASSERT_EQ(policy.input_dim(), 2);
  const std::string text = to_json(policy, {{"angle_rad", "rate_radps"}, {"torque_nm"}});
  const std::vector<std::string> said = c_says(text + "\nnames\ntext\n");
  EXPECT_EQ(said.at(1), "angle_rad rate_radps  > torque_nm> ");
  EXPECT_EQ(said.at(2), text) << "they stay with it";
  EXPECT_EQ(c_says(to_json(policy) + "\nnames\n").at(1), "   > > ");
  std::string wrong = text;
  wrong.replace(wrong.find("rate_radps"), 10, "angle_rad");
  EXPECT_THAT(c_says(wrong + "\n").at(0), HasSubstr("error: policy: $.signals are wrong: inputs"));
}

TEST(PolicyLibraryTest, SaysWhyItDoesNotDoWhatItIsAsked) {
  test::RandomMixture random(1);
  const TreePolicy policy(TreeModel::from_global(FrameKind::kCholesky, {random.gmm(1, 2, 1)}, {{}}),
                          1, ThetaLayout::kMeans);
  const std::vector<std::string> said =
      c_says(to_json(policy) + "\ntheta 1\ntheta 1 inf\nact 1 2\nact nan\nact 0\n");
  ASSERT_EQ(said.size(), 7);
  EXPECT_EQ(said[1], "error: theta has 1 numbers, must have 2");
  EXPECT_EQ(said[2], "error: theta must be finite");
  EXPECT_EQ(said[3], "error: input has 2 numbers, must have 1");
  EXPECT_EQ(said[4], "error: input must be finite");
  EXPECT_THAT(said[5], HasSubstr("0x"));
  EXPECT_THAT(c_says("{\"no\": \"policy\"}\n")[0], HasSubstr("error: "));
  EXPECT_THAT(c_says("\n")[0], HasSubstr("error: "));
}

TEST(PolicyLibraryTest, ABoundedRateHoldsOnWithAnotherTheta) {
  test::RandomMixture random(1);
  const TreePolicy policy(TreeModel::from_global(FrameKind::kCholesky, {random.gmm(1, 2, 1)}, {{}}),
                          1, ThetaLayout::kMeans);
  const PolicyPtr within =
      bounded(std::make_shared<TreePolicy>(policy), {.output_rate_max = {20}, .sample_time_s = .1});
  const std::vector<std::string> said =
      c_says(to_json(*within) + "\ntheta 0 0\nact 0\ntheta 0 8\nand 0\ntheta 0 9\nand 0\nact 0\n");
  ASSERT_EQ(said.size(), 6);
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<double> given = {0, 2, 4, 9};
    EXPECT_DOUBLE_EQ(std::strtod(said[i + 1].c_str(), nullptr), given[i]) << i;
  }
}

TEST(PolicyLibraryTest, ExportsItsInterfaceAlone) {
  worker::Child nm({"-D", "--defined-only", "--format=posix", TREEROLL_POLICY_LIBRARY}, "",
                   "/usr/bin/nm");
  ASSERT_EQ(nm.wait(), 0) << nm.errors();
  std::set<std::string> names;
  for (const std::string& line : lines_of(nm.output())) {
    names.insert(line.substr(0, line.find_first_of("@ ")));
  }
  names.erase("TREEROLL_POLICY_0");
  EXPECT_THAT(names,
              testing::ElementsAre("treeroll_policy_act", "treeroll_policy_free",
                                   "treeroll_policy_get_theta", "treeroll_policy_input_dim",
                                   "treeroll_policy_input_name", "treeroll_policy_last_error",
                                   "treeroll_policy_load", "treeroll_policy_output_dim",
                                   "treeroll_policy_output_name", "treeroll_policy_set_theta",
                                   "treeroll_policy_start", "treeroll_policy_text",
                                   "treeroll_policy_theta_dim", "treeroll_policy_version"));
}

}  // namespace
}  // namespace treeroll
