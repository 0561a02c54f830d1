#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/mixture/random_mixture.h"
#include "tests/tasks/rollouts.h"

namespace treeroll {
namespace {

using nlohmann::json;

struct Case {
  const char* name;
  const char* task;
  const char* settings;
  int input_dim;
  int output_dim;
};

class EvaluateAllTest : public ::testing::TestWithParam<Case> {};

/// Whatever is beside an evaluation: none, some, more than any processor computes side by side.
TEST_P(EvaluateAllTest, GivesTheBitsOfEvaluate) {
  const Case& c = GetParam();
  TaskRegistry registry;
  add_standard_tasks(registry);
  json resolved;
  const auto task = registry.make(c.task, json::parse(c.settings), resolved);
  test::RandomMixture random(5);
  std::vector<std::unique_ptr<TreeController>> controllers;
  std::vector<Task::Evaluation> all;
  std::vector<Outcome> alone;
  for (std::uint64_t i = 0; i < 11; ++i) {
    const Gmm gmm = random.gmm(c.input_dim, c.input_dim + c.output_dim, 3);
    controllers.push_back(std::make_unique<TreeController>(gmm));
    alone.push_back(task->evaluate(*controllers.back(), i));
    all.push_back({*controllers.back(), i});
  }
  for (std::size_t count = 0; count <= all.size(); ++count) {
    const auto together = task->evaluate_all(std::span(all).first(count));
    ASSERT_EQ(together.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(together[i].status(), alone[i].status()) << i << " of " << count;
      EXPECT_EQ(together[i].reward(), alone[i].reward()) << i << " of " << count;
    }
  }
}

constexpr Case kCases[] = {
    {"rk4", "swing_up", R"({"plant": "rk4", "step_s": 5e-3})", 1, 1},
    {"ode", "swing_up", R"({"duration_s": 0.2})", 1, 1},
    {"dopri5", "swing_up", R"({"plant": "dopri5", "duration_s": 0.2})", 1, 1},
    {"varied", "swing_up", R"({"plant": "rk4", "step_s": 5e-3, "variation":
       {"evaluations": 3, "parameter_fraction": 0.1, "start_deviation_rad": 0.1}})",
     1, 1},
    {"track", "track", R"({"plant": "rk4", "step_s": 5e-3, "duration_s": 1})", 1, 1},
    {"hold", "hold", R"({"plant": "rk4", "step_s": 5e-3, "duration_s": 0.2})", 6, 1},
    {"trajectory", "trajectory",
     R"({"goal": {"inputs": 1, "outputs": [1, -1], "deviations": [0.25, 0.3]}})", 1, 1},
    {"spiral", "spiral", "{}", 1, 2},
    {"synthetic", "synthetic", R"({"noise_deviation": 0.1, "fail_fraction": 0.3})", 1, 1},
};

INSTANTIATE_TEST_SUITE_P(Tasks, EvaluateAllTest, ::testing::ValuesIn(kCases),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace treeroll
