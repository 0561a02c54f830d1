// Rule "auto": CMA-ES whose first step is tried.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/numbers/elementary.h"
#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"
#include "common/settings/settings_reader.h"
#include "learner/explore/cma_es_rule.h"
#include "learner/explore/exploration.h"
#include "learner/explore/exploration_settings.h"

namespace treeroll::explore {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

LinearPolicy constant_spline(double value) {
  return {std::make_shared<SplineForm>(std::make_shared<SplineLadder>(BSpline(3, 8, 0, 2.2), 1),
                                       nullptr),
          Eigen::MatrixXd::Constant(1, 8, value), 1};
}

ExplorationSettings read_automatic_settings(const json& table, const Policy& policy,
                                            json* resolved_out = nullptr) {
  json resolved;
  SettingsReader reader(table, "exploration", resolved);
  ExplorationSettings settings = read_exploration_settings(reader, policy);
  reader.finish();
  if (resolved_out) *resolved_out = resolved;
  return settings;
}

/// Rewards fall with the distance of theta from a goal.
double reward_near(const Eigen::VectorXd& theta, double goal) {
  return elementary::exp(-(theta.array() - goal).square().mean());
}

std::vector<double> rewards_of(ExplorationSettings settings, const Policy& policy, double goal,
                               std::vector<Eigen::VectorXd>* thetas = nullptr) {
  Exploration run(settings, policy, 3, 0);
  std::vector<double> rewards;
  while (!run.done()) {
    std::vector<Draw> out;
    while (std::optional<Draw> draw = run.ask()) out.push_back(*draw);
    for (const Draw& draw : out) {
      rewards.push_back(reward_near(draw.theta, goal));
      if (thetas) thetas->push_back(draw.theta);
      run.tell(draw.rollout, Outcome::ok(rewards.back()));
    }
  }
  return rewards;
}

TEST(AutomaticRuleTest, IsThatOfAStudyWithoutAKey) {
  json resolved;
  const ExplorationSettings settings =
      read_automatic_settings(json::object(), constant_spline(10), &resolved);
  EXPECT_EQ(settings.rule,
            RuleSettings(CmaEsRuleSettings{.rate_factor = 5, .bold_rate_factor = 2}));
  EXPECT_EQ(resolved["rule"], "auto");
  EXPECT_NEAR(*settings.initial_step, .05, 1e-12);  // .005 of the output's rms
  EXPECT_NEAR(settings.bold_step, .8, 1e-12);
  EXPECT_EQ(read_automatic_settings(resolved, constant_spline(10)), settings);
  // As when there was no other way.
  EXPECT_EQ(read_automatic_settings({{"noise_variance", {1.}}}, constant_spline(10)).rule,
            RuleSettings(PowerSettings{}));
}

/// Who finds the first trials too bold on a robot makes the step smaller.
TEST(AutomaticRuleTest, ASmallerStepMakesTheTrialLessBold) {
  const auto bold_step = [](const json& table, double start) {
    return read_automatic_settings(table, constant_spline(start)).bold_step;
  };
  EXPECT_NEAR(bold_step({{"initial_step", .005}}, 10), .08, 1e-12);
  EXPECT_NEAR(bold_step({{"initial_step", 1}}, 10), .8, 1e-12);
  EXPECT_NEAR(bold_step({{"initial_step", .02}, {"output_scale", 2}}, 0), .06, 1e-12);
}

TEST(AutomaticRuleTest, EveryRuleCanDoWithoutANoise) {
  for (const char* rule : {"power", "pi2", "cem", "cma_es"}) {
    ExplorationSettings settings =
        read_automatic_settings({{"rule", rule}, {"initial_step", 1}}, constant_spline(10));
    settings.num_rollouts = 400;
    const std::vector<double> rewards = rewards_of(settings, constant_spline(10), 11);
    EXPECT_GT(*std::max_element(rewards.begin(), rewards.end()), .9) << rule;
  }
}

/// Rewards that fall with the distance from a goal of any size.
double best_near(double size, ExplorationSettings settings) {
  Exploration run(settings, constant_spline(0), 3, 0);
  double best = 0;
  while (!run.done()) {
    while (const std::optional<Draw> draw = run.ask()) {
      const Eigen::VectorXd miss = (draw->theta.array() - size) / size;
      best = std::max(best, elementary::exp(-miss.squaredNorm() / 8));
      run.tell(draw->rollout, Outcome::ok(elementary::exp(-miss.squaredNorm() / 8)));
    }
  }
  return best;
}

/// From nothing, and nobody has said how large an output of a good policy is.
TEST(AutomaticRuleTest, FindsTheSizeOfTheOutputItself) {
  json resolved;
  ExplorationSettings settings =
      read_automatic_settings(json::object(), constant_spline(0), &resolved);
  EXPECT_TRUE(settings.tries_scale);
  EXPECT_EQ(resolved["output_scale"], "auto");
  EXPECT_EQ(read_automatic_settings(resolved, constant_spline(0)), settings);
  settings.num_rollouts = 300;
  for (const double size : {.003, .02, .7, 5., 40., 300.}) {
    EXPECT_GT(best_near(size, settings), .85) << size;
  }
}

TEST(AutomaticRuleTest, TheFirstGenerationTriesAllSizesInPairs) {
  ExplorationSettings settings = read_automatic_settings(json::object(), constant_spline(0));
  settings.num_rollouts = 24;
  settings.in_flight = 24;
  Exploration run(settings, constant_spline(0), 3, 0);
  std::vector<Draw> generation;
  while (std::optional<Draw> draw = run.ask()) generation.push_back(*draw);
  ASSERT_EQ(generation.size(), 12U);  // the next waits
  EXPECT_EQ(generation[0].theta, Eigen::VectorXd::Zero(8));
  for (std::size_t i = 1; i + 1 < 12; i += 2) {
    EXPECT_TRUE(generation[i].theta.isApprox(-generation[i + 1].theta, 1e-9)) << i;
    const double sizes[] = {1, .2, 5, .02, 50};
    const double rms = std::sqrt(generation[i].theta.squaredNorm() / 8);
    EXPECT_GT(rms, .03 * sizes[i / 2]);
    EXPECT_LT(rms, 3 * sizes[i / 2]);
  }
  // Of the largest size, one is the best.
  for (const Draw& draw : generation) {
    run.tell(draw.rollout, Outcome::ok(draw.rollout == 9 ? .9 : .1));
  }
  const std::optional<Draw> next = run.ask();
  ASSERT_TRUE(next);
  EXPECT_GT(std::sqrt(next->theta.squaredNorm() / 8), 3);
}

/// Of a spline of two layers with two draws under way: the place of the first switch.
int first_switch(const std::function<double(int)>& reward) {
  const LinearPolicy ladder(
      std::make_shared<SplineForm>(std::make_shared<SplineLadder>(BSpline(3, 5, 0, 2), 2), nullptr),
      Eigen::MatrixXd::Zero(1, 7), 1);
  ExplorationSettings settings = read_automatic_settings({{"convergence_window", 12}}, ladder);
  settings.num_rollouts = 60;
  Exploration run(settings, ladder, 3, 0);
  while (!run.done()) {
    const std::optional<Draw> draw = run.ask();
    run.tell(draw->rollout, Outcome::ok(reward(draw->rollout)));
  }
  return run.switches().empty() ? -1 : run.switches().front();
}

/// Sizes are tried one after the other, the likeliest first, so their rewards fall.
TEST(AutomaticRuleTest, ATrialOfSizesDoesNotCountAsConvergence) {
  const auto falling = [](int rollout) { return 1. / (1 + rollout); };
  EXPECT_EQ(first_switch(falling), 23);  // by the twelve results behind those of the trial
  EXPECT_EQ(first_switch([](int rollout) { return rollout < 12 ? 12. - rollout : 13. + rollout; }),
            -1);
}

TEST(AutomaticRuleTest, OtherRulesNeedAScaleForAStartFromNothing) {
  for (const json& table :
       {json{{"rule", "cma_es"}}, json{{"rule", "power"}}, json{{"initial_step", .1}}}) {
    try {
      read_automatic_settings(table, constant_spline(0));
      ADD_FAILURE() << table;
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.key(), "exploration.output_scale");
      EXPECT_THAT(error.what(), HasSubstr("the start policy does nothing"));
    }
  }
  EXPECT_THROW(read_automatic_settings({{"output_scale", "auto"}}, constant_spline(10)),
               ConfigError);
  const ExplorationSettings settings =
      read_automatic_settings({{"output_scale", 2}}, constant_spline(0));
  EXPECT_EQ(*settings.initial_step, .2);
  EXPECT_EQ(settings.bold_step, .6);
  for (const json& bad :
       {json{{"output_scale", 0}}, json{{"metric", "path"}}, json{{"initial_step", -1}},
        json{{"bold_step", 1}}, json{{"population", 12}}}) {
    EXPECT_THROW(read_automatic_settings(bad, constant_spline(10)), ConfigError) << bad;
  }
  EXPECT_THROW(
      read_automatic_settings({{"noise_variance", {1.}}, {"metric", "full"}}, constant_spline(10)),
      ConfigError);
}

/// Layers of 43 and 83 coefficients for each of 12 outputs: the finer one is too large.
LinearPolicy large_ladder() {
  return {std::make_shared<SplineForm>(std::make_shared<SplineLadder>(BSpline(3, 43, 0, 2), 2),
                                       nullptr),
          Eigen::MatrixXd::Constant(12, 83, 1), 1};
}

/// A learner would say nothing for minutes.
TEST(AutomaticRuleTest, APolicyIsRefusedWhereALayersStartWouldTakeMinutes) {
  const LinearPolicy large = large_ladder();
  const json variance(std::vector<double>(12, 1));
  read_automatic_settings({{"last_layer", 1}}, large);
  read_automatic_settings({{"noise_variance", variance}, {"reuse", false}}, large);
  read_automatic_settings({{"noise_variance", variance}, {"first_layer", 2}}, large);
  const auto refused = [&](const json& table, const char* key, const char* rule) {
    try {
      read_automatic_settings(table, large);
      ADD_FAILURE() << table;
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.key(), key) << table;
      EXPECT_THAT(error.what(), HasSubstr(rule));
      EXPECT_THAT(error.what(), HasSubstr("theta of layer 2 has 996 elements for 12 outputs"));
    }
  };
  refused(json::object(), "exploration.noise_variance", "is required");
  refused({{"rule", "cma_es"}, {"coordinates", "sensitivity"}}, "exploration.coordinates",
          "must be \"noise_variance\"");
  refused({{"noise_variance", variance}}, "exploration.reuse", "must be false");
}

TEST(AutomaticRuleTest, GoesBackToASmallStepFromAGoodStart) {
  ExplorationSettings settings = read_automatic_settings(json::object(), constant_spline(10));
  settings.num_rollouts = 24;
  std::vector<Eigen::VectorXd> thetas;
  rewards_of(settings, constant_spline(10), 10, &thetas);
  EXPECT_EQ(thetas[0], constant_spline(10).theta());  // the mean among the first generation
  const auto spread = [&](std::size_t first, std::size_t last) {
    double sum = 0;
    for (std::size_t i = first; i < last; ++i) sum += (thetas[i].array() - 10).square().mean();
    return std::sqrt(sum / static_cast<double>(last - first));
  };
  EXPECT_NEAR(spread(1, 12) / spread(12, 24), 16, 8);
  EXPECT_EQ(thetas[13] - constant_spline(10).theta(), -(thetas[12] - constant_spline(10).theta()));
}

/// Rewards fall with the distance of the outputs from a goal, over [0, 2.2].
double reward_of_outputs(const LinearPolicy& policy, const Eigen::VectorXd& theta, double goal) {
  const std::unique_ptr<Controller> controller = policy.with(theta)->controller();
  double squares = 0;
  for (int i = 0; i < 23; ++i) {
    const double time = .1 * i;
    double output = 0;
    controller->act({&time, 1}, {&output, 1});
    squares += (output - goal) * (output - goal) / 23;
  }
  return elementary::exp(-squares);
}

struct RunTowards {
  std::vector<Eigen::VectorXd> thetas;
  std::vector<double> rewards;
  Eigen::VectorXd mean;  // in the end
};

/// From a start of 10 everywhere, which has one systematic step.
RunTowards run_towards(double goal, const std::function<double(int, double)>& earned,
                       int num_rollouts = 300, int in_flight = 1) {
  const LinearPolicy start = constant_spline(10);
  ExplorationSettings settings = read_automatic_settings(json::object(), start);
  settings.num_rollouts = num_rollouts;
  settings.in_flight = in_flight;
  Exploration exploration(settings, start, 3, 0);
  RunTowards run;
  while (!exploration.done()) {
    std::vector<Draw> out;
    while (std::optional<Draw> draw = exploration.ask()) out.push_back(*draw);
    for (const Draw& draw : out) {
      run.thetas.push_back(draw.theta);
      run.rewards.push_back(earned(draw.rollout, reward_of_outputs(start, draw.theta, goal)));
      exploration.tell(draw.rollout, Outcome::ok(run.rewards.back()));
    }
  }
  run.mean = exploration.mean();
  return run;
}

double as_it_is(int /*rollout*/, double reward) { return reward; }

/// After the bold trial and one bold generation, four generations of the step both ways.
TEST(AutomaticRuleTest, MendsAGainFromABadStart) {
  const RunTowards run = run_towards(13, as_it_is);
  EXPECT_GT((run.thetas[13] - run.thetas[0]).norm(), 10);  // bold
  EXPECT_LT(run.rewards[0], .001);
  EXPECT_NEAR(run.thetas[24].mean(), 13, .2);
  EXPECT_NEAR(run.thetas[25].mean(), 7, .2);
  EXPECT_GT(run.rewards[24], .99);
  // What follows stays near.
  EXPECT_GT(*std::min_element(run.rewards.begin() + 32, run.rewards.end()), .3);
}

/// Little, or nothing at all, is earned along the steps.
TEST(AutomaticRuleTest, GoesOnBoldlyWhereNoSystematicStepHelps) {
  for (const double share : {.001, 0.}) {
    const RunTowards run = run_towards(13, [share](int rollout, double reward) {
      return rollout >= 24 && rollout < 32 ? share * reward : reward;
    });
    EXPECT_EQ(run.thetas.size(), 300U);
    EXPECT_GT((run.thetas[33] - run.thetas[34]).norm(), 5);
    EXPECT_GT(*std::max_element(run.rewards.begin(), run.rewards.end()), .9);
  }
}

/// A budget that ends within the search leaves the policy that it has found.
TEST(AutomaticRuleTest, TheMeanFollowsTheSearchAlongTheSteps) {
  for (const int num_rollouts : {26, 29, 32, 33}) {
    EXPECT_NEAR(run_towards(13, as_it_is, num_rollouts).mean.mean(), 13, .2) << num_rollouts;
  }
}

/// Nothing earns anything, so that the mean is no member of the generation that teaches at last.
TEST(AutomaticRuleTest, APlateauBeforeABadStartChangesNothing) {
  const RunTowards run =
      run_towards(13, [](int rollout, double reward) { return rollout < 12 ? 0 : reward; });
  EXPECT_NEAR(run.thetas[36].mean(), 13, .2);
  EXPECT_GT(*std::max_element(run.rewards.begin(), run.rewards.end()), .99);
}

/// Whatever is under way at once: generations are whole, and of several sizes.
TEST(AutomaticRuleTest, GivesTheSameBitsWhateverIsInFlight) {
  const RunTowards one = run_towards(13, as_it_is, 100, 1);
  EXPECT_NEAR(one.thetas[24].mean(), 13, .2);  // has come to the steps
  EXPECT_EQ(one.thetas, run_towards(13, as_it_is, 100, 8).thetas);
  EXPECT_EQ(one.thetas, run_towards(13, as_it_is, 100, 32).thetas);
}

}  // namespace
}  // namespace treeroll::explore
