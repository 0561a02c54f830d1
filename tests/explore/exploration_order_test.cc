// Which roll-outs are drawn when, and what a draw depends on.
#include <gtest/gtest.h>

#include <cmath>

#include "trees.h"

namespace treeroll::explore {
namespace {

/// Everything that may be asked for now.
std::vector<Draw> ask_all(Exploration& run) {
  std::vector<Draw> draws;
  while (std::optional<Draw> draw = run.ask()) draws.push_back(*std::move(draw));
  return draws;
}

TEST(ExplorationOrderTest, DrawsRolloutIAsSoonAsIMinusInFlightPlusOneResultsAreIn) {
  struct Case {
    int in_flight;
    std::vector<int> num_drawn;  // after 0, 1, 2, ... results, of 10
  };
  const Case cases[] = {
      {1, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10}},
      {3, {3, 4, 5, 6, 7, 8, 9, 10, 10, 10, 10}},
      {8, {8, 9, 10, 10, 10, 10, 10, 10, 10, 10, 10}},
      {2'000'000'000, {10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10}},
  };
  for (const Case& expected : cases) {
    ExplorationSettings settings = settings_for_means();
    settings.num_rollouts = 10;
    settings.in_flight = expected.in_flight;
    settings.rule = PowerSettings{.first_update = 2};
    Exploration run = run_over_means(settings, flat_tree());
    int num_drawn = 0;
    for (int told = 0; told <= 10; ++told) {
      for (const Draw& draw : ask_all(run)) EXPECT_EQ(draw.rollout, num_drawn++);
      EXPECT_EQ(num_drawn, expected.num_drawn[static_cast<std::size_t>(told)])
          << "in flight " << expected.in_flight << ", told " << told;
      EXPECT_EQ(run.num_told(), told);
      EXPECT_EQ(run.done(), told == 10);
      if (told < 10) run.tell(told, Outcome::ok(.5));
    }
  }
}

TEST(ExplorationOrderTest, CountsResultsInAnyOrder) {
  ExplorationSettings settings = settings_for_means();
  settings.in_flight = 3;
  Exploration run = run_over_means(settings, flat_tree());
  EXPECT_EQ(ask_all(run).size(), 3u);
  run.tell(2, Outcome::ok(.5));
  EXPECT_EQ(ask_all(run).at(0).rollout, 3);
  run.tell(3, Outcome::ok(.5));
  EXPECT_EQ(ask_all(run).at(0).rollout, 4);
  run.tell(0, Outcome::ok(.5));
  EXPECT_EQ(ask_all(run).at(0).rollout, 5);
}

TEST(ExplorationOrderTest, DrawsDoNotDependOnWhenTheyAreAskedFor) {
  ExplorationSettings settings = settings_for_means();
  settings.num_rollouts = 30;
  settings.in_flight = 3;
  settings.rule = PowerSettings{.first_update = 2};
  Exploration eager = run_over_means(settings, flat_tree());
  Exploration late = run_over_means(settings, flat_tree());
  std::vector<Draw> of_eager = ask_all(eager);
  std::vector<Draw> of_late;
  for (int i = 0; i < 30; ++i) {
    if (static_cast<int>(of_late.size()) == i) {
      for (Draw& draw : ask_all(late)) of_late.push_back(std::move(draw));
    }
    const double reward = .5 + .4 * std::sin(i);
    late.tell(i, Outcome::ok(reward));
    eager.tell(i, Outcome::ok(reward));
    for (Draw& draw : ask_all(eager)) of_eager.push_back(std::move(draw));
  }
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(of_eager.at(static_cast<std::size_t>(i)).theta,
              of_late.at(static_cast<std::size_t>(i)).theta)
        << i;
  }
}

TEST(ExplorationOrderTest, EqualKeysGiveEqualDrawsAndOthersOtherOnes) {
  ExplorationSettings settings = settings_for_means();
  settings.in_flight = 3;
  const auto draws = [&settings](std::uint64_t seed, std::uint32_t repetition) {
    Exploration run(settings, TreePolicy(flat_tree(), 1, ThetaLayout::kMeans), seed, repetition);
    return ask_all(run);
  };
  const std::vector<Draw> reference = draws(1, 1);
  EXPECT_EQ(draws(1, 1).at(2).theta, reference.at(2).theta);
  EXPECT_NE(reference.at(0).theta, reference.at(1).theta);
  EXPECT_NE(draws(2, 1).at(0).theta, reference.at(0).theta);
  EXPECT_NE(draws(1, 2).at(0).theta, reference.at(0).theta);
}

TEST(ExplorationOrderTest, FirstDrawsHaveTheInitialNoiseOfEachComponent) {
  constexpr int kDraws = 20000;
  ExplorationSettings settings = settings_for_means();
  settings.num_rollouts = settings.in_flight = kDraws;
  settings.initial_noise_factor = .5;
  Exploration run = run_over_means(settings, flat_tree());
  const Eigen::Vector4d variance(.005, .02, .005, .02);
  EXPECT_EQ(run.noise(), variance.asDiagonal().toDenseMatrix());
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Draw& draw : ask_all(run)) {
    const Eigen::Vector4d deviation = draw.theta - run.mean();
    sum += deviation * deviation.transpose();
  }
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double expected = i == j ? variance(i) : 0;
      const double sigma =
          std::sqrt((i == j ? 2 : 1) * variance(i) * variance(j) / static_cast<double>(kDraws));
      EXPECT_NEAR(sum(i, j) / kDraws, expected, 4 * sigma) << i << ", " << j;
    }
  }
}

TEST(ExplorationOrderTest, OneBatchToldInAnyOrderGivesTheSameUpdate) {
  ExplorationSettings settings = settings_for_means();
  settings.in_flight = 5;
  settings.rule = PowerSettings{.first_update = 5, .best_considered = 3};
  const double rewards[] = {.2, .9, .4, .9, .4};
  const auto after = [&](const std::vector<int>& order) {
    Exploration run = run_over_means(settings, flat_tree());
    ask_all(run);
    for (const int i : order) run.tell(i, Outcome::ok(rewards[i]));
    return run;
  };
  const Exploration forwards = after({0, 1, 2, 3, 4});
  const Eigen::VectorXd start = run_over_means(settings, flat_tree()).mean();
  EXPECT_NE(forwards.mean(), start);
  for (const std::vector<int>& order :
       {std::vector<int>{4, 3, 2, 1, 0}, {3, 1, 4, 0, 2}, {2, 4, 0, 3, 1}}) {
    const Exploration scrambled = after(order);
    EXPECT_EQ(scrambled.mean(), forwards.mean());
    EXPECT_EQ(scrambled.noise(), forwards.noise());
    EXPECT_EQ(scrambled.best().rollout, 1);
  }
}

TEST(ExplorationOrderTest, ReplayingTheSameResultsGivesTheSameBits) {
  ExplorationSettings settings = settings_for_means();
  settings.num_rollouts = 300;
  settings.in_flight = 4;
  settings.convergence_window = 8;
  settings.last_layer = 2;
  struct Told {
    int rollout;
    double reward;
  };
  std::vector<Told> told;
  std::vector<Draw> drawn;
  Exploration run = run_over_means(settings, two_layer_tree());
  std::vector<Draw> open;
  while (!run.done()) {
    for (Draw& draw : ask_all(run)) {
      drawn.push_back(draw);
      open.push_back(std::move(draw));
    }
    // Arrival out of order: the one whose turn a number derived from the count makes it.
    const auto next = open.begin() + static_cast<std::ptrdiff_t>(told.size() * 7 % open.size());
    const double reward = std::exp(-next->theta.squaredNorm());
    told.push_back({next->rollout, reward});
    open.erase(next);
    run.tell(told.back().rollout, Outcome::ok(reward));
  }
  ASSERT_EQ(run.switches().size(), 1u);

  Exploration replay = run_over_means(settings, two_layer_tree());
  std::size_t num_compared = 0;
  for (const Told& result : told) {
    for (const Draw& draw : ask_all(replay)) {
      EXPECT_EQ(draw.layer, drawn[num_compared].layer);
      EXPECT_EQ(draw.theta, drawn[num_compared++].theta) << draw.rollout;
    }
    replay.tell(result.rollout, Outcome::ok(result.reward));
  }
  EXPECT_EQ(num_compared, 300u);
  EXPECT_EQ(replay.mean(), run.mean());
  EXPECT_EQ(replay.noise(), run.noise());
  EXPECT_EQ(replay.best().theta, run.best().theta);
  EXPECT_EQ(replay.switches(), run.switches());
}

TEST(ExplorationOrderDeathTest, RefusesResultsNobodyWaitsForAndRewardsThatAreNone) {
  ExplorationSettings settings = settings_for_means();
  settings.in_flight = 2;
  Exploration run = run_over_means(settings, flat_tree());
  EXPECT_DEATH(run.tell(0, Outcome::ok(1)), "without having been asked for");
  ask_all(run);
  run.tell(0, Outcome::ok(1));
  EXPECT_DEATH(run.tell(0, Outcome::ok(1)), "told twice");
  EXPECT_DEATH(run.tell(1, Outcome::ok(-1)), "not negative");
  EXPECT_DEATH(run.tell(1, Outcome::ok(NAN)), "must be finite");
}

}  // namespace
}  // namespace treeroll::explore
