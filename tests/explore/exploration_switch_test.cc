// When a run learns, and when it goes on to the next layer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "learner/explore/convergence.h"
#include "trees.h"

namespace treeroll::explore {
namespace {

/// Asks for all that may be drawn; returns the layer of each by number.
void layers_asked(Exploration& run, std::vector<int>& layers) {
  while (const std::optional<Draw> draw = run.ask()) layers.push_back(draw->layer);
}

ExplorationSettings two_layers(int first_update, int window, int in_flight) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = first_update};
  settings.convergence_window = window;
  settings.in_flight = in_flight;
  settings.last_layer = 2;
  settings.reuse = false;
  return settings;
}

/// Rewards that fall from the start: their slope is below 0 at any length.
double falling(int i) { return 1 - 1e-3 * i; }

TEST(ExplorationSwitchTest, LeavesAFallingLayerAtTheRightCountAndNotBefore) {
  struct Case {
    int first_update, window, in_flight, expected_results;
  };
  for (const Case& of : {Case{10, 20, 1, 20}, Case{30, 20, 1, 30}, Case{5, 8, 4, 11},
                         Case{5, 5, 1, 5}, Case{12, 8, 32, 43}}) {
    Exploration run =
        run_over_means(two_layers(of.first_update, of.window, of.in_flight), two_layer_tree());
    std::vector<int> layers;
    for (int i = 0; i < of.expected_results; ++i) {
      EXPECT_EQ(run.layer(), 1) << i;
      EXPECT_TRUE(run.switches().empty());
      layers_asked(run, layers);
      run.tell(i, Outcome::ok(falling(i)));
    }
    EXPECT_EQ(run.layer(), 2);
    EXPECT_EQ(run.switches(), std::vector<int>{of.expected_results - 1});
    // Draws already out stay in their layer, the next is of the new one.
    layers_asked(run, layers);
    EXPECT_EQ(layers.back(), 2);
    EXPECT_EQ(std::count(layers.begin(), layers.end(), 1), of.expected_results + of.in_flight - 1);
  }
}

TEST(ExplorationSwitchTest, WaitsUntilTheSlopeOfTheWindowIsBelowTheThreshold) {
  for (const double threshold : {0., -2e-3, 5e-3}) {
    ExplorationSettings settings = two_layers(5, 10, 1);
    settings.convergence_slope = threshold;
    Exploration run = run_over_means(settings, two_layer_tree());
    std::vector<int> layers;
    std::vector<double> rewards;
    for (int i = 0; run.switches().empty(); ++i) {
      ASSERT_LT(i, 100);
      layers_asked(run, layers);
      rewards.push_back(i < 25 ? .01 * i : .25 - .005 * (i - 25));
      run.tell(i, Outcome::ok(rewards.back()));
      if (rewards.size() < 10) continue;
      const double slope = least_squares_slope(std::span(rewards).last(10));
      EXPECT_EQ(run.switches().size(), slope < threshold ? 1u : 0u) << i << ", slope " << slope;
      if (run.switches().empty()) {
        EXPECT_EQ(run.reward_slope(), slope);
      }
    }
    EXPECT_FALSE(run.reward_slope()) << "the new layer begins with an empty window";
    EXPECT_GT(run.switches()[0], 25);
  }
}

TEST(ExplorationSwitchTest, WithAGainInPlaceOfTheSlopeLeavesWhenTheBestHasAllButStoppedRising) {
  // Rewards that rise ever slower, with bad spells that the slope takes for convergence.
  const auto reward = [](int i) { return 1 - std::exp(-i / 25.) - (i % 20 >= 13 ? .4 : 0); };
  const auto first_switch = [&](std::optional<double> gain, int in_flight) {
    ExplorationSettings settings = two_layers(5, 15, in_flight);
    settings.convergence_gain = gain;
    Exploration run = run_over_means(settings, two_layer_tree());
    std::vector<int> layers;
    GainWindow expected(15);
    for (int i = 0; run.switches().empty(); ++i) {
      layers_asked(run, layers);
      run.tell(i, Outcome::ok(reward(i)));
      expected.add(reward(i));
      if (!gain) continue;
      const bool is_enough = i + 1 >= 15 + in_flight - 1;
      const bool has_slowed = expected.share() && *expected.share() < *gain;
      EXPECT_EQ(!run.switches().empty(), is_enough && has_slowed) << i;
    }
    return run.switches()[0];
  };
  EXPECT_LT(first_switch({}, 1), 25);
  EXPECT_GT(first_switch(.3, 1), 40);
  EXPECT_GT(first_switch(.1, 1), first_switch(.3, 1));
  EXPECT_EQ(first_switch(.3, 4), first_switch(.3, 1)) << "long past the least number of results";
}

TEST(ExplorationSwitchTest, StaysWithEqualRewardsAndInTheLastLayer) {
  Exploration equal = run_over_means(two_layers(5, 10, 1), two_layer_tree());
  ExplorationSettings by_gain = two_layers(5, 10, 1);
  by_gain.convergence_gain = 1;
  Exploration equal_by_gain = run_over_means(by_gain, two_layer_tree());
  ExplorationSettings last_only = two_layers(5, 10, 1);
  last_only.first_layer = 2;
  Exploration last = run_over_means(last_only, two_layer_tree());
  std::vector<int> layers;
  for (int i = 0; i < 200; ++i) {
    layers_asked(equal, layers);
    equal.tell(i, Outcome::ok(.1));
    layers_asked(equal_by_gain, layers);
    equal_by_gain.tell(i, Outcome::ok(.1));
    layers_asked(last, layers);
    last.tell(i, Outcome::ok(falling(i)));
  }
  EXPECT_TRUE(equal.switches().empty());
  EXPECT_TRUE(equal_by_gain.switches().empty());
  EXPECT_TRUE(last.switches().empty());
  EXPECT_EQ(last.policy(2).layer(), 2);
}

TEST(ExplorationSwitchTest, TheNextLayerStartsFromTheFinalMeanWithFreshNoise) {
  ExplorationSettings settings = two_layers(5, 10, 1);
  settings.initial_noise_factor = .5;
  Exploration run = run_over_means(settings, two_layer_tree());
  std::vector<int> layers;
  // The mean after the tenth update, from a run that goes on in layer 1.
  settings.last_layer = 1;
  Exploration in_layer_1 = run_over_means(settings, two_layer_tree());
  for (int i = 0; i < 10; ++i) {
    layers_asked(run, layers);
    run.tell(i, Outcome::ok(falling(i)));
    layers_asked(in_layer_1, layers);
    in_layer_1.tell(i, Outcome::ok(falling(i)));
  }
  ASSERT_EQ(run.layer(), 2);
  const TreeModel expected = tree_policy(run, 1).tree_with(in_layer_1.mean());
  EXPECT_EQ(tree_policy(run, 2).tree().layer(2)[3].mean, expected.layer(2)[3].mean);
  EXPECT_EQ(run.mean(), to_theta(ThetaLayout::kMeans, expected.layer(2)));
  EXPECT_EQ(run.mean().size(), 8);
  EXPECT_NE(run.mean(), to_theta(ThetaLayout::kMeans, two_layer_tree().layer(2)));
  EXPECT_EQ(run.noise(), Eigen::Vector2d(.005, .02).replicate(4, 1).asDiagonal().toDenseMatrix());
  // What the roll-outs of layer 1 were drawn for stays as it was.
  EXPECT_EQ(run.policy(1).theta(), to_theta(ThetaLayout::kMeans, spaced_gmm(2)));
}

TEST(ExplorationSwitchTest, StaysInItsLayerWhileNoTreeCanBeMadeOfItsMean) {
  ExplorationSettings settings = two_layers(2, 5, 1);
  settings.convergence_slope = 100;  // would switch after the fifth result
  settings.num_rollouts = 30;
  settings.noise_variance = {.01, kGmmMagnitudeMax * kGmmMagnitudeMax};
  int num_kept = 0;
  int num_switched_late = 0;
  for (std::uint32_t repetition = 0; repetition < 40; ++repetition) {
    SCOPED_TRACE(repetition);
    Exploration run = run_over_means(settings, two_layer_tree(), repetition);
    for (int i = 0; !run.done(); ++i) {
      while (run.ask()) continue;
      run.tell(i, Outcome::ok(1 + .01 * i));
      if (i < 4 || run.layer() > 1) continue;
      EXPECT_THROW(static_cast<void>(tree_policy(run, 1).tree_with(run.mean()).finest()),
                   std::invalid_argument);
    }
    EXPECT_EQ(run.num_told(), 30);
    if (run.switches().empty()) ++num_kept;
    if (!run.switches().empty() && run.switches()[0] > 4) ++num_switched_late;
  }
  EXPECT_GT(num_kept, 0);
  EXPECT_GT(num_switched_late, 0);
}

TEST(ExplorationSwitchTest, ALateResultOfALeftLayerIsRecordedAndNeverLearntFrom) {
  Exploration run = run_over_means(two_layers(4, 4, 3), two_layer_tree());
  std::vector<int> layers;
  for (int i = 0; i < 6; ++i) {
    layers_asked(run, layers);
    run.tell(i, Outcome::ok(falling(i)));
  }
  ASSERT_EQ(run.layer(), 2);
  layers_asked(run, layers);
  ASSERT_EQ(layers, (std::vector<int>{1, 1, 1, 1, 1, 1, 1, 1, 2}));
  const Eigen::VectorXd mean = run.mean();
  const Eigen::MatrixXd noise = run.noise();
  // Two late ones, one of them the best of all; then layer 2 counts from one.
  run.tell(6, Outcome::ok(.1));
  run.tell(7, Outcome::ok(5));
  EXPECT_EQ(run.num_told(), 8);
  EXPECT_EQ(run.best().rollout, 7);
  EXPECT_EQ(run.best().layer, 1);
  EXPECT_EQ(run.best().reward, 5);
  EXPECT_EQ(run.best().theta.size(), 4);
  EXPECT_FALSE(run.reward_slope());
  for (int i = 8; i < 11; ++i) {
    layers_asked(run, layers);
    EXPECT_EQ(run.mean(), mean);
    EXPECT_EQ(run.noise(), noise);
    run.tell(i, Outcome::ok(.2));
  }
  EXPECT_EQ(run.mean(), mean) << "three results of this layer are not yet S_init";
  run.tell(11, Outcome::ok(.2));
  EXPECT_NE(run.mean(), mean);
  EXPECT_NE(run.noise(), noise);
  EXPECT_EQ(run.best().rollout, 7);
}

TEST(ExplorationLearnTest, LearnsFirstAtSInitResultsThenAtEachOne) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = 4};
  Exploration run = run_over_means(settings, flat_tree());
  std::vector<int> layers;
  const Eigen::VectorXd start = run.mean();
  Eigen::MatrixXd before = run.noise();
  for (int i = 0; i < 12; ++i) {
    layers_asked(run, layers);
    run.tell(i, Outcome::ok(.1 + .01 * i));
    EXPECT_EQ(run.mean() != start, i >= 3) << i;
    EXPECT_EQ(run.noise() != before, i >= 3) << i;
    before = run.noise();
  }
}

TEST(ExplorationLearnTest, AFailedRolloutCountsWithRewardZeroWhateverItSays) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = 2, .best_considered = 2};
  Exploration failing = run_over_means(settings, flat_tree());
  Exploration zero = run_over_means(settings, flat_tree());
  std::vector<int> layers;
  for (int i = 0; i < 8; ++i) {
    const bool fails = i % 2 == 1;
    layers_asked(failing, layers);
    failing.tell(i, {fails ? NAN : .3, fails ? RolloutStatus::kDiverged : RolloutStatus::kOk});
    layers_asked(zero, layers);
    zero.tell(i, Outcome::ok(fails ? 0 : .3));
  }
  EXPECT_EQ(failing.num_told(), 8);
  EXPECT_EQ(failing.mean(), zero.mean());
  EXPECT_EQ(failing.noise(), zero.noise());
  EXPECT_EQ(failing.best().rollout, 0);
  EXPECT_EQ(failing.best().reward, .3);
}

TEST(ExplorationLearnTest, RewardsOfZeroChangeNothing) {
  Exploration run = run_over_means(settings_for_means(), flat_tree());
  const Eigen::VectorXd mean = run.mean();
  const Eigen::MatrixXd noise = run.noise();
  std::vector<int> layers;
  for (int i = 0; i < 50; ++i) {
    layers_asked(run, layers);
    run.tell(i, {1. * (i % 2), i % 2 == 0 ? RolloutStatus::kOk : RolloutStatus::kTimedOut});
    EXPECT_EQ(run.mean(), mean);
    EXPECT_EQ(run.noise(), noise);
  }
  EXPECT_EQ(run.best().rollout, 0);
}

TEST(ExplorationLearnTest, TheBestOfTheWholeHistoryWeighInEachUpdate) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = 2, .best_considered = 2};
  settings.num_rollouts = 500;
  Exploration run = run_over_means(settings, flat_tree());
  std::vector<Eigen::VectorXd> thetas;
  for (int i = 0; i < 500; ++i) {
    thetas.push_back(run.ask()->theta);
    run.tell(i, Outcome::ok(i == 3 ? 3 : i == 9 ? 1 : .001));
  }
  EXPECT_TRUE(run.mean().isApprox(.75 * thetas[3] + .25 * thetas[9], 1e-14));
}

TEST(ExplorationLearnTest, TheMinimumNoiseDecaysWithTheResultsOfTheRun) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{
      .first_update = 1, .best_considered = 1, .minimum_noise = {.fraction = .1, .decay_start = 5}};
  settings.initial_noise_factor = 3;  // of the initial noise alone
  Exploration run = run_over_means(settings, flat_tree());
  const Eigen::Vector4d variance(.01, .04, .01, .04);
  for (int i = 0; i < 20; ++i) {
    run.ask();
    // The first stays the best: from the second update on the mean is its theta, the spread none.
    run.tell(i, Outcome::ok(i == 0 ? 1 : .5));
    if (i == 0) continue;
    const double decay = i + 1 <= 5 ? 1 : 5. / (i + 1);
    EXPECT_TRUE(run.noise().isApprox((.1 * decay * variance).asDiagonal().toDenseMatrix(), 1e-14))
        << i;
  }
}

TEST(ExplorationLearnTest, TheDecayGoesOnAcrossASwitch) {
  ExplorationSettings settings = two_layers(1, 2, 1);
  settings.rule = PowerSettings{
      .first_update = 1, .best_considered = 1, .minimum_noise = {.fraction = .1, .decay_start = 1}};
  Exploration run = run_over_means(settings, two_layer_tree());
  std::vector<int> layers;
  for (int i = 0; i < 4; ++i) {
    layers_asked(run, layers);
    run.tell(i, Outcome::ok(falling(i)));
  }
  ASSERT_EQ(layers, (std::vector<int>{1, 1, 2, 2}));
  // The second update of layer 2: no spread, and four results of the run.
  const Eigen::VectorXd variance = Eigen::Vector2d(.01, .04).replicate(4, 1);
  EXPECT_TRUE(run.noise().isApprox((.1 / 4 * variance).asDiagonal().toDenseMatrix(), 1e-14));
}

}  // namespace
}  // namespace treeroll::explore
