// Runs whose rule updates once a generation, and runs that stop early.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "learner/explore/cem_rule.h"
#include "learner/explore/cma_es_rule.h"
#include "learner/explore/pi2_rule.h"
#include "trees.h"

namespace treeroll::explore {
namespace {

/// A rule by its word, and settings of it for generations of one size.
struct Kind {
  const char* name;
  RuleSettings (*rule)(GenerationSettings generation);
};

RuleSettings pi2(GenerationSettings generation) { return Pi2Settings{.generation = generation}; }
RuleSettings cem(GenerationSettings generation) {
  return CemSettings{.generation = generation, .elites = std::min(5, generation.population)};
}
RuleSettings cma_es(GenerationSettings generation) {
  return CmaEsRuleSettings{.generation = generation};
}
/// PoWER, for one batch of that size.
RuleSettings power(GenerationSettings generation) {
  return PowerSettings{.first_update = generation.population, .best_considered = 5};
}

constexpr Kind kPopulationRules[] = {{"pi2", pi2}, {"cem", cem}, {"cma_es", cma_es}};

ExplorationSettings settings_with(const RuleSettings& rule, int in_flight) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = rule;
  settings.in_flight = in_flight;
  return settings;
}

/// A bump around a point near the start.
double bump(const Eigen::VectorXd& theta) {
  double square = 0;
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    square += std::pow(theta[i] - .1 * static_cast<double>(i % 3), 2);
  }
  return std::exp(-square);
}

TEST(ExplorationPopulationTest, UpdatesOnceAGenerationAndHoldsDrawsUntilItIsComplete) {
  for (const Kind& kind : kPopulationRules) {
    Exploration run = run_over_means(settings_with(kind.rule({.population = 6}), 4), flat_tree());
    std::vector<Draw> out;
    Eigen::VectorXd mean = run.mean();
    int asked = 0;
    for (int told = 0; told < 30; ++told) {
      while (std::optional<Draw> draw = run.ask()) {
        out.push_back(*std::move(draw));
        ++asked;
      }
      // Four in flight, and none beyond the generation.
      EXPECT_EQ(asked, std::min(told + 4, (told / 6 + 1) * 6)) << told;
      run.tell(told, Outcome::ok(bump(out[static_cast<std::size_t>(told)].theta)));
      EXPECT_EQ(run.mean() != mean, told % 6 == 5) << told;
      mean = run.mean();
    }
  }
}

TEST(ExplorationPopulationTest, StaleGenerationsKeepTheFlightFull) {
  for (const Kind& kind : kPopulationRules) {
    ExplorationSettings settings =
        settings_with(kind.rule({.population = 6, .complete = false}), 4);
    settings.num_rollouts = 31;
    Exploration run = run_over_means(settings, flat_tree());
    std::vector<Draw> out;
    Eigen::VectorXd mean = run.mean();
    for (int told = 0; told < 31; ++told) {
      while (std::optional<Draw> draw = run.ask()) out.push_back(*std::move(draw));
      EXPECT_EQ(out.size(), static_cast<std::size_t>(std::min(told + 4, 31)));
      run.tell(told, Outcome::ok(bump(out[static_cast<std::size_t>(told)].theta)));
      EXPECT_EQ(run.mean() != mean, told % 6 == 5) << "the last, partial generation is dropped";
      mean = run.mean();
    }
    EXPECT_TRUE(run.done());
  }
}

TEST(ExplorationPopulationTest, NeitherTheOrderWithinAGenerationNorThatOfEqualRewardsCounts) {
  // With distinct rewards, with few values, so that most of them are equal to others, and with
  // equal ones only; told in many orders.
  const std::vector<std::function<double(const Eigen::VectorXd&)>> rewards_of = {
      bump, [](const Eigen::VectorXd& theta) { return std::ceil(40 * bump(theta)) / 40; },
      [](const Eigen::VectorXd&) { return .5; }};
  for (const Kind& kind :
       {Kind{"power", power}, Kind{"pi2", pi2}, Kind{"cem", cem}, Kind{"cma_es", cma_es}}) {
    const bool is_power = kind.rule == power;
    for (std::size_t shape = 0; shape < rewards_of.size(); ++shape) {
      for (const int stride :
           {7, 3, 5}) {  // i -> stride i + 3 modulo 8, from the last to the first
        ExplorationSettings settings = settings_with(kind.rule({.population = 8}), 8);
        // It learns at each later result, so that their order counts.
        if (is_power) settings.num_rollouts = 8;
        Exploration forward = run_over_means(settings, flat_tree());
        Exploration scrambled = run_over_means(settings, flat_tree());
        const Eigen::VectorXd start = forward.mean();
        for (int g = 0; g < (is_power ? 1 : 5); ++g) {
          std::vector<double> rewards;
          for (int i = 0; i < 8; ++i) {
            rewards.push_back(rewards_of[shape](forward.ask()->theta));
            scrambled.ask();
          }
          for (int i = 0; i < 8; ++i) {
            const int other = (stride * (7 - i) + 3) % 8;
            forward.tell(8 * g + i, Outcome::ok(rewards[static_cast<std::size_t>(i)]));
            scrambled.tell(8 * g + other, Outcome::ok(rewards[static_cast<std::size_t>(other)]));
          }
          SCOPED_TRACE(testing::Message() << kind.name << ", rewards " << shape << ", stride "
                                          << stride << ", generation " << g);
          ASSERT_EQ(forward.mean(), scrambled.mean());
          ASSERT_EQ(forward.noise(), scrambled.noise());
          ASSERT_EQ(forward.best().rollout, scrambled.best().rollout);
        }
        // CMA-ES's mirrored draws of equal reward cancel: but for it, all of them have learnt.
        if (shape < 2) {
          EXPECT_NE(forward.mean(), start);
        }
      }
    }
  }
}

TEST(ExplorationPopulationTest, MirroredDrawsAreOppositeInPairs) {
  for (const bool mirrored : {true, false}) {
    const ExplorationSettings settings =
        settings_with(CmaEsRuleSettings{.generation = {.population = 6}, .mirrored = mirrored}, 6);
    Exploration run = run_over_means(settings, flat_tree());
    const Eigen::VectorXd mean = run.mean();
    for (int pair = 0; pair < 3; ++pair) {
      const Eigen::VectorXd there = run.ask()->theta - mean;
      const Eigen::VectorXd back = run.ask()->theta - mean;
      EXPECT_EQ((there + back).norm() < 1e-12, mirrored);
      EXPECT_GT(there.norm(), 1e-3);
    }
  }
}

TEST(ExplorationPopulationTest, EveryRuleLearnsTheBump) {
  for (const Kind& kind : kPopulationRules) {
    for (const bool complete : {true, false}) {
      const GenerationSettings generation{.population = 10, .complete = complete};
      ExplorationSettings settings = settings_with(kind.rule(generation), complete ? 1 : 8);
      // The elite of a slope is narrow: without a floor CEM stops short of the top.
      if (kind.rule == cem) {
        settings.rule = CemSettings{
            .generation = generation, .elites = 5, .noise = {.minimum = {.fraction = .2}}};
      }
      settings.num_rollouts = 400;
      Exploration run = run_over_means(settings, flat_tree());
      const double start = bump(run.mean());
      std::map<int, double> out;
      while (!run.done()) {
        while (const std::optional<Draw> draw = run.ask()) out[draw->rollout] = bump(draw->theta);
        const auto [rollout, reward] = *out.begin();
        out.erase(out.begin());
        run.tell(rollout, Outcome::ok(reward));
      }
      EXPECT_LT(start, .5);
      EXPECT_GT(bump(run.mean()), .99) << kind.name << complete;
    }
  }
}

TEST(ExplorationPopulationTest, AGenerationWithoutRewardTeachesNothing) {
  for (const Kind& kind : kPopulationRules) {
    Exploration run = run_over_means(settings_with(kind.rule({.population = 4}), 1), flat_tree());
    const Eigen::VectorXd mean = run.mean();
    const Eigen::MatrixXd noise = run.noise();
    for (int i = 0; i < 20; ++i) {
      run.ask();
      run.tell(i, Outcome::failed(RolloutStatus::kDiverged));
      EXPECT_EQ(run.mean(), mean);
      EXPECT_EQ(run.noise(), noise);
    }
  }
}

TEST(ExplorationPopulationTest, ASwitchGoesOnFromTheBestRolloutWithProjectedNoise) {
  for (const Kind& kind : kPopulationRules) {
    ExplorationSettings settings = settings_with(kind.rule({.population = 6}), 1);
    settings.convergence_window = 10;
    settings.last_layer = 2;
    Exploration run = run_over_means(settings, two_layer_tree());
    settings.reuse = false;
    Exploration afresh = run_over_means(settings, two_layer_tree());
    Eigen::VectorXd best;
    Eigen::VectorXd mean_left;
    for (int i = 0; run.layer() == 1; ++i) {
      const Eigen::VectorXd theta = run.ask()->theta;
      afresh.ask();
      if (i == 2) best = theta;
      // Falls but for the third, in the middle of the second generation.
      const double reward = i == 2 ? 2 : 1 - .01 * i;
      mean_left = afresh.mean();
      run.tell(i, Outcome::ok(reward));
      afresh.tell(i, Outcome::ok(reward));
    }
    EXPECT_EQ(run.switches(), std::vector<int>{9});
    EXPECT_EQ(run.mean(),
              to_theta(ThetaLayout::kMeans, tree_policy(run, 1).tree_with(best).layer(2)));
    EXPECT_EQ(afresh.mean(),
              to_theta(ThetaLayout::kMeans, tree_policy(afresh, 1).tree_with(mean_left).layer(2)));
    EXPECT_EQ(afresh.noise(),
              Eigen::Vector2d(.01, .04).replicate(4, 1).asDiagonal().toDenseMatrix());
    // Moving a parent's mean moves both children: their perturbations are coupled.
    EXPECT_GT(run.noise()(0, 2) / std::sqrt(run.noise()(0, 0) * run.noise()(2, 2)), .5);
    EXPECT_LT(std::abs(run.noise()(0, 4)), .5 * run.noise()(0, 2));
  }
}

TEST(ExplorationStopTest, StopsAtTheTargetAndTakesInWhatIsStillOut) {
  ExplorationSettings settings = settings_for_means();
  settings.rule = PowerSettings{.first_update = 2, .best_considered = 2};
  settings.in_flight = 3;
  settings.stop_at_reward = .9;
  Exploration run = run_over_means(settings, flat_tree());
  for (int i = 0; i < 8; ++i) {
    while (run.ask()) {
    }
    run.tell(i, Outcome::ok(i == 7 ? .9 : .5 + .01 * i));
    EXPECT_EQ(run.stopped_early(), i == 7);
  }
  EXPECT_FALSE(run.done()) << "8 and 9 are out";
  EXPECT_FALSE(run.ask());
  const Eigen::VectorXd mean = run.mean();
  run.tell(9, Outcome::ok(.95));
  EXPECT_FALSE(run.done());
  run.tell(8, Outcome::ok(.1));
  EXPECT_TRUE(run.done());
  EXPECT_FALSE(run.ask());
  EXPECT_EQ(run.num_told(), 10);
  EXPECT_EQ(run.best().rollout, 9);
  EXPECT_EQ(run.mean(), mean);
}

TEST(ExplorationStopTest, AFailedRolloutReachesNoTarget) {
  ExplorationSettings settings = settings_for_means();
  settings.stop_at_reward = .5;
  Exploration run = run_over_means(settings, flat_tree());
  run.ask();
  run.tell(0, {.9, RolloutStatus::kDiverged});
  EXPECT_FALSE(run.stopped_early());
  run.ask();
  run.tell(1, Outcome::ok(.5));
  EXPECT_TRUE(run.done());
}

TEST(ExplorationStopTest, StopsWhenTheLastLayerHasConvergedIfTheStudySaysSo) {
  for (const bool stops : {true, false}) {
    ExplorationSettings settings = settings_for_means();
    settings.rule = PowerSettings{.first_update = 5, .best_considered = 2};
    settings.convergence_window = 10;
    settings.last_layer = 2;
    settings.stop_on_convergence = stops;
    settings.num_rollouts = 50;
    Exploration run = run_over_means(settings, two_layer_tree());
    int told = 0;
    for (; !run.done(); ++told) {
      run.ask();
      run.tell(told, Outcome::ok(1 - 1e-3 * told));
    }
    EXPECT_EQ(run.switches(), std::vector<int>{9});
    EXPECT_EQ(told, stops ? 20 : 50);
    EXPECT_EQ(run.stopped_early(), stops);
  }
}

}  // namespace
}  // namespace treeroll::explore
