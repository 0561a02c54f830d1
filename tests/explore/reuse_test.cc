#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "common/policy/tree/experience.h"
#include "learner/explore/power_update.h"
#include "learner/explore/projected_noise.h"
#include "trees.h"

namespace treeroll::explore {
namespace {

TEST(ProjectedNoiseTest, TheJacobianSaysWhereASmallStepLeads) {
  const TreePolicy left{two_layer_tree(), 1, ThetaLayout::kMeansCholesky};
  RandomStream random(5, 0, 0, RandomPurpose::kPerturbation);
  Eigen::VectorXd mean = left.theta();
  for (double& element : mean) element += .1 * random.next_normal();
  const NextLayer next = left.next_layer(mean);
  const auto jacobian =
      projection_jacobian(next.project, mean, Eigen::VectorXd::Constant(mean.size(), .1));
  ASSERT_TRUE(jacobian);
  Eigen::VectorXd step(mean.size());
  for (double& element : step) element = 1e-5 * random.next_normal();
  const Eigen::VectorXd moved = *next.project(mean + step) - next.policy->theta();
  EXPECT_LT((moved - *jacobian * step).norm(), 1e-3 * moved.norm());
}

TEST(ProjectedNoiseTest, UnexploredDirectionsGetAShareOfTheExploredDeviation) {
  Eigen::MatrixXd jacobian(3, 2);  // the span of (1, 1, 0), twice
  jacobian << 1, 2, 1, 2, 0, 0;
  const Eigen::MatrixXd explored = 4 * Eigen::Vector3d(1, 1, 0) * Eigen::RowVector3d(1, 1, 0) / 2;
  const Eigen::MatrixXd noise =
      with_unexplored_directions(explored, jacobian, Eigen::Vector3d::Ones());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(noise);
  EXPECT_TRUE(axes.eigenvalues().isApprox(Eigen::Vector3d(.36, .36, 4), 1e-12));
  // The unit says how lengths compare.
  const Eigen::Vector3d unit(1, 1, 10);
  const Eigen::MatrixXd in_units = with_unexplored_directions(explored, jacobian, unit);
  EXPECT_NEAR(in_units(2, 2), 36, 1e-12);
}

/// Algorithm 2 with reuse, layer 1 left after ten results.
Exploration switched(const ExplorationSettings& settings) {
  Exploration run = run_over_means(settings, two_layer_tree());
  for (int i = 0; run.layer() == 1; ++i) {
    run.ask();
    run.tell(i, Outcome::ok(1 - 1e-3 * i));
  }
  return run;
}

TEST(ReuseTest, TheNextLayerLearnsFromTheProjectedBestAtItsFirstResult) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = 5, .best_considered = 3};
  settings.convergence_window = 10;
  settings.last_layer = 2;
  Exploration run = run_over_means(settings, two_layer_tree());
  std::vector<RatedRollout> told;
  for (int i = 0; run.layer() == 1; ++i) {
    told.push_back({i, 1 - 1e-3 * i, run.ask()->theta});
    run.tell(i, Outcome::ok(told.back().reward));
  }
  ASSERT_EQ(told.size(), 10U);
  const Eigen::VectorXd mean_before = run.mean();
  EXPECT_EQ(mean_before, run.policy(2).theta());

  std::vector<RatedRollout> best(told.begin(), told.begin() + 3);
  for (RatedRollout& rollout : best) {
    rollout.theta = *project_experience(tree_policy(run, 1), tree_policy(run, 2), rollout.theta);
  }
  const Draw first = *run.ask();
  ASSERT_EQ(first.layer, 2);
  run.tell(10, Outcome::ok(2));
  best.insert(best.begin(), {10, 2, first.theta});
  best.pop_back();
  const Eigen::VectorXd minimum = 5e-3 * Eigen::Vector2d(.01, .04).replicate(4, 1);
  const auto expected = power_update(best, mean_before, minimum);
  EXPECT_EQ(run.mean(), expected->mean);
  EXPECT_EQ(run.noise(), expected->noise);
}

TEST(ReuseTest, TheNoiseAtTheSwitchIsThatOfTheExperienceAndReachesEveryDirection) {
  ExplorationSettings settings = settings_for_means();
  settings.convergence_window = 10;
  settings.last_layer = 2;
  const Exploration bold = switched([&] {
    ExplorationSettings of_bold = settings;
    of_bold.initial_noise_factor = 100;
    return of_bold;
  }());
  const Exploration run = switched(settings);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(run.noise());
  EXPECT_GT(axes.eigenvalues()[0], 1e-6);
  EXPECT_GT(bold.noise().trace(), 20 * run.noise().trace()) << "it follows what was explored";

  settings.reuse = false;
  const Exploration afresh = switched(settings);
  EXPECT_EQ(afresh.noise(), Eigen::Vector2d(.01, .04).replicate(4, 1).asDiagonal().toDenseMatrix());
}

TEST(ReuseTest, ExperienceWithoutRewardLeavesTheNoiseAsItStarts) {
  ExplorationSettings settings = settings_for_means();
  settings.convergence_window = 10;
  settings.convergence_slope = .1;
  settings.last_layer = 2;
  Exploration run = run_over_means(settings, two_layer_tree());
  for (int i = 0; run.layer() == 1; ++i) {
    run.ask();
    run.tell(i, Outcome::ok(0));
  }
  EXPECT_EQ(run.noise(), Eigen::Vector2d(.01, .04).replicate(4, 1).asDiagonal().toDenseMatrix());
}

}  // namespace
}  // namespace treeroll::explore
