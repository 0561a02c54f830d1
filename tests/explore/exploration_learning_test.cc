// That a run learns, and what it holds while it does.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>

#include "common/mixture/gmr.h"
#include "trees.h"

namespace treeroll::explore {
namespace {

/// exp(-20 MSE) between the policy's curve and 1, 1, -1, -1 of four equal Gaussians over [0, 2].
double trajectory_reward(const Gmm& policy) {
  std::vector<Component> goal_components = spaced_gmm(4).components();
  for (int k = 0; k < 4; ++k)
    goal_components[static_cast<std::size_t>(k)].mean(1) = k < 2 ? .6 : -.6;
  const Gmr goal(Gmm(1, std::move(goal_components)));
  const Gmr curve(policy);
  double sum = 0;
  for (int i = 0; i < 25; ++i) {
    const double time = 2 * (i + .5) / 25;
    const double error = curve.regress(time) - goal.regress(time);
    sum += error * error;
  }
  return std::exp(-20 * sum / 25);
}

struct Learnt {
  double first = 0;  // mean of the first and the last ten rewards
  double last = 0;
  std::size_t num_switches = 0;
};

Learnt learn(const ExplorationSettings& settings, const TreeModel& start,
             std::uint32_t repetition) {
  Exploration run = run_over_means(settings, start, repetition);
  Learnt learnt;
  while (const std::optional<Draw> draw = run.ask()) {
    const double reward = trajectory_reward(tree_policy(run, draw->layer).decode(draw->theta));
    if (draw->rollout < 10) learnt.first += reward / 10;
    if (draw->rollout >= settings.num_rollouts - 10) learnt.last += reward / 10;
    run.tell(draw->rollout, Outcome::ok(reward));
  }
  EXPECT_TRUE(run.done());
  learnt.num_switches = run.switches().size();
  return learnt;
}

TEST(ExplorationLearningTest, ImprovesATrajectoryWithAFlatModelAndWithATree) {
  ExplorationSettings settings = settings_for_means();
  settings.num_rollouts = 300;
  settings.rule =
      PowerSettings{.first_update = 5, .best_considered = 5, .minimum_noise = {.fraction = 2e-2}};
  ExplorationSettings of_tree = settings;
  of_tree.last_layer = 2;
  const TreeModel flat = TreeModel::from_global(FrameKind::kCholesky, {spaced_gmm(4)}, {{}});
  constexpr int kSeeds = 8;
  Learnt of_flat_model;
  Learnt of_tree_model;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    const Learnt flat_run = learn(settings, flat, seed);
    of_flat_model.first += flat_run.first / kSeeds;
    of_flat_model.last += flat_run.last / kSeeds;
    const Learnt tree_run = learn(of_tree, two_layer_tree(), seed);
    of_tree_model.first += tree_run.first / kSeeds;
    of_tree_model.last += tree_run.last / kSeeds;
    EXPECT_EQ(tree_run.num_switches, 1u) << "seed " << seed;
  }
  EXPECT_LT(of_flat_model.first, .2);
  EXPECT_GT(of_flat_model.last, .8);
  EXPECT_LT(of_tree_model.first, .2);
  EXPECT_GT(of_tree_model.last, .8);
}

/// Bytes allocated and not freed in this process; 0 where the allocator does not count
/// (sanitizers).
std::size_t bytes_in_use() { return mallinfo2().uordblks; }

TEST(ExplorationLearningTest, HoldsNoMoreAfterAHundredThousandResultsThanAfterAThousand) {
  if (bytes_in_use() == 0) GTEST_SKIP() << "this allocator does not count";
  ExplorationSettings settings = settings_for_means();
  settings.num_rollouts = 101'000;
  settings.in_flight = 3;
  settings.rule = PowerSettings{.best_considered = 5};
  Exploration run = run_over_means(settings, flat_tree());
  std::size_t after_a_thousand = 0;
  while (const std::optional<Draw> draw = run.ask()) {
    run.tell(draw->rollout, Outcome::ok(std::exp(-draw->theta.squaredNorm())));
    if (run.num_told() == 1000) after_a_thousand = bytes_in_use();
  }
  EXPECT_EQ(run.num_told(), 101'000);
  // A history kept in full would hold 100 000 thetas of 32 bytes.
  EXPECT_LT(bytes_in_use(), after_a_thousand + 10'000);
}

}  // namespace
}  // namespace treeroll::explore
