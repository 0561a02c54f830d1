#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string>

#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "tests/thesis/run_study.h"
#include "workers/tasks/task.h"

/// A task of a user's own with a state of four numbers and two outputs, and a study of it that says
/// nothing of how to explore.
namespace treeroll {
namespace {

/// A mass on a plane stands where a saddle throws it off: what is let go along one axis leaves ever
/// faster, along the other it swings. Two actuators pull across both axes. Reward exp(-alpha x mean
/// cost); 1 is at rest in the middle all the time.
class SaddleTask : public Task {
 public:
  explicit SaddleTask(SettingsReader& settings)
      : mass_kg_(settings.number("mass_kg", kPositive, 1)) {}

  TaskDescription description() const override {
    return {.input_dim = 4, .output_dim = 2, .reward_max = 1, .time_limit_s = 10};
  }

  Outcome evaluate(Controller& controller, std::uint64_t /*seed*/) override {
    constexpr double kStep = .01;  // s
    constexpr int kSteps = 300;
    std::array<double, 4> state{.3, -.2, 0, 0};  // x, y in m, and their rates
    std::array<double, 2> force{};               // N
    double cost = 0;
    controller.start();
    for (int step = 0; step < kSteps; ++step) {
      controller.act(state, force);
      state[2] += kStep * (4 * state[0] + (.8 * force[0] + .6 * force[1]) / mass_kg_);
      state[3] += kStep * (-9 * state[1] + (-.6 * force[0] + .8 * force[1]) / mass_kg_);
      state[0] += kStep * state[2];
      state[1] += kStep * state[3];
      cost += state[0] * state[0] + state[1] * state[1] +
              .1 * (state[2] * state[2] + state[3] * state[3]);
      if (!(cost < 1e6)) {
        return Outcome::failed(RolloutStatus::kDiverged, "the mass has left the plane");
      }
    }
    return Outcome::ok(elementary::exp(-10 * cost / kSteps));
  }

 private:
  double mass_kg_;
};

constexpr const char* kSaddleStudy = R"(
[study]
name = "saddle"
rollouts = 400
repetitions = 10

[task]
name = "saddle"

[[conditions]]
name = "network"
[conditions.policy]
kind = "auto"
start = "constant"
ranges = [[-0.5, 0.5], [-0.5, 0.5], [-1.5, 1.5], [-1.5, 1.5]]
values = [0.0, 0.0]

[[conditions]]
name = "linear"
[conditions.policy]
start = "components"
layout = "reduced_cholesky"
[conditions.policy.layer_1]
inputs = 4
means = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
deviations = [0.3, 0.3, 1.0, 1.0, 1.0, 1.0]
)";

class SeveralOutputsTest : public ::testing::TestWithParam<double> {
 protected:
  std::vector<RunRecord> learn() const {
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) /
        ("saddle_" + std::to_string(static_cast<int>(GetParam() * 100)) + ".toml");
    std::ofstream(file) << kSaddleStudy;
    TaskRegistry tasks;
    add_task<SaddleTask>(tasks, "saddle");
    const auto runs = run_study(file, {"task.mass_kg=" + std::to_string(GetParam())}, tasks);
    std::filesystem::remove(file);
    return runs;
  }
};

/// Forces of a tenth of a newton hold one mass, of hundreds the other: nobody says so.
TEST_P(SeveralOutputsTest, AStateOfFourIsHeldByTwoWithoutAKeyOfExploration) {
  const std::vector<RunRecord> runs = learn();
  for (const char* condition : {"network", "linear"}) {
    const std::vector<RunRecord> of = of_condition(runs, condition);
    EXPECT_LT(of.front().start->reward(), .01) << condition;
    EXPECT_GT(mean_best(of), .6) << condition;
    for (const RunRecord& run : of) EXPECT_GT(run.best_reward, .4) << condition;
  }
}

INSTANTIATE_TEST_SUITE_P(Masses, SeveralOutputsTest, ::testing::Values(.02, 1., 50.),
                         [](const auto& info) {
                           return "hundredths_of_kg_" +
                                  std::to_string(static_cast<int>(info.param * 100));
                         });

/// A path from a constant start, as the README's study has it: no key says how to explore it. Means
/// in time move nothing at first, so nothing but a bound tells how far they may step.
TEST(ConstantStartTest, IsLearntByTheDefaultRecipeAndInSensitivityCoordinates) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "constant_start.toml";
  std::ofstream(file) << R"(
[study]
name = "constant_start"
rollouts = 300
repetitions = 60

[task]
name = "trajectory"
duration_s = 2.0
alpha = 20.0
[task.goal]
outputs = [0.8, 0.4, -0.2, -0.9]
deviations = [0.25, 0.3]

[policy]
start = "components"
layout = "means"
[policy.layer_1]
range = [0.0, 2.0]
outputs = [0.0, 0.0]
deviations = [0.35, 0.3]
[policy.layer_2]
range = [0.0, 2.0]
outputs = [0.0, 0.0, 0.0, 0.0]
deviations = [0.25, 0.3]
parents = [1, 1, 2, 2]

[[conditions]]
name = "tree"

[[conditions]]
name = "flat"
policy.model = "flat"

[[conditions]]
name = "sensitivity"
policy.model = "flat"
exploration.rule = "cma_es"
exploration.coordinates = "sensitivity"
)";
  const auto runs = run_study(file, {});
  std::filesystem::remove(file);
  // Of a thousand .983, .990 and .991 have come to .97 by then.
  for (const char* condition : {"tree", "flat", "sensitivity"}) {
    const std::vector<RunRecord> of = of_condition(runs, condition);
    const auto num_learnt = std::count_if(
        of.begin(), of.end(), [](const RunRecord& run) { return run.best_reward >= .97; });
    EXPECT_GE(num_learnt, 57) << condition;
    EXPECT_GE(mean_best(of), .985) << condition;
    for (const RunRecord& run : of) EXPECT_GE(run.best_reward, .9) << condition;
  }
}

/// deploy/studies/hold_untuned.toml with the one key that it has taken away.
TEST(UntunedHoldTest, LearnsNoWorseThanWithTunedNoise) {
  const auto runs = run_study(std::filesystem::path(TREEROLL_STUDIES_DIR) / "hold_untuned.toml",
                              {"exploration.output_scale=\"auto\"", "study.repetitions=5"});
  // hold.toml comes to .858 and .850.
  for (const char* condition : {"linear", "tree", "network"}) {
    EXPECT_GT(mean_best(of_condition(runs, condition)), .86) << condition;
  }
}

}  // namespace
}  // namespace treeroll
