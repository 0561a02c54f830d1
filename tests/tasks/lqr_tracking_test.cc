#include "workers/tasks/lqr_tracking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "common/base/config_error.h"
#include "sim/rk4_plant.h"
#include "tests/sim/swing_up_input.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

RestRegulator regulator(const std::string& lqr, double rest_rad,
                        const sim::PlantSettings& plant = {}) {
  const nlohmann::json settings = nlohmann::json::parse(R"({"lqr": )" + lqr + "}");
  nlohmann::json resolved;
  SettingsReader reader(settings, "task", resolved);
  RestRegulator made(reader, plant, rest_rad);
  reader.finish();
  return made;
}

std::string refused_weights(const std::string& lqr) {
  try {
    (void)regulator(lqr, 0);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// The swing-up that ends upright, through the equations of motion in steps of 5 ms.
NominalMotion swing_up_motion(double step_s) {
  NominalMotion motion;
  (void)sim::Rk4Plant({}, step_s)
      .simulate(sim::kHanging, sim::kSwingUpDurationS, sim::feed_forward(sim::kRefined),
                [&](double time_s, const sim::CartPendulumState& state, double acceleration) {
                  motion.add(time_s, {}, state, acceleration);
                  return true;
                });
  return motion;
}

double refined(double time_s) { return sim::cart_acceleration(sim::kRefined, time_s); }

TEST(RestRegulatorTest, RestsAtItsTargetAndPushesBackFromBesideIt) {
  for (const double rest : {0., -std::numbers::pi}) {
    const RestRegulator about = regulator("{}", rest);
    EXPECT_EQ(about.acceleration({.phi1 = rest, .phi2 = rest}), 0);
    EXPECT_NEAR(about.acceleration({.phi1 = rest, .phi2 = rest, .y = 1}), -10, 1e-6);
  }
}

TEST(RestRegulatorTest, OnlyTheRatiosOfTheWeightsCount) {
  const RestRegulator as_is = regulator("{}", 0);
  const RestRegulator scaled =
      regulator(R"({"state_weights": [1000, 1000, 100, 10, 10, 10], "input_weight": 1})", 0);
  EXPECT_LT((as_is.gains() - scaled.gains()).norm(), 1e-6 * as_is.gains().norm());
}

TEST(RestRegulatorTest, SaysWhatIsWrongWithItsSettings) {
  EXPECT_THAT(refused_weights(R"({"input_weight": 0})"), HasSubstr("task.lqr.input_weight = 0"));
  EXPECT_THAT(refused_weights(R"({"state_weights": [1, 2]})"), HasSubstr("task.lqr.state_weights"));
  EXPECT_THAT(refused_weights(R"({"state_weights": [1, 1, 1, 1, 1, -1]})"),
              HasSubstr("task.lqr.state_weights"));
  EXPECT_THAT(refused_weights(R"({"state_weights": [100, 100, 0, 1, 1, 1]})"),
              HasSubstr("must be such that a stable regulator comes of them"));
  EXPECT_THAT(refused_weights(R"({"state_weights": [0, 0, 0, 0, 0, 0]})"),
              HasSubstr("must be such that a stable regulator comes of them"));
  EXPECT_THAT(refused_weights(R"({"input_weight": 1e-6})"), HasSubstr("a simulation follows 100"));
  EXPECT_THAT(refused_weights(R"({"gain": 3})"), HasSubstr("task.lqr.gain"));
}

TEST(RestRegulatorTest, IsNoFasterThanTheStepsOfItsPlantFollow) {
  sim::PlantSettings plant;
  plant.kind = sim::PlantKind::kRk4;
  plant.step_s = .05;
  EXPECT_THROW(regulator("{}", 0, plant), ConfigError);
  plant.step_s = .01;
  EXPECT_NO_THROW(regulator("{}", 0, plant));
  plant = {};
  plant.kind = sim::PlantKind::kDopri5;
  EXPECT_NO_THROW(regulator("{}", 0, plant));
}

TEST(NominalMotionTest, IsTheMotionAtItsStepsAndCloseToItBetweenThem) {
  const NominalMotion coarse = swing_up_motion(.005);
  const NominalMotion fine = swing_up_motion(.0005);
  EXPECT_EQ(sim::to_state(coarse.state(0)), sim::kHanging);
  double worst = 0;
  for (int k = 0; k < 400; ++k) {  // the first fifth: there both simulations still agree
    worst = std::max(worst, (coarse.state(.001 * k) - fine.state(.001 * k)).norm());
  }
  EXPECT_LT(worst, 2e-5);
}

/// Of any motion: where the plant is on it, the regulator adds nothing.
TEST(MotionRegulatorTest, AddsNothingOnTheMotionAndEndsAsTheRegulatorOfRest) {
  const RestRegulator upright = regulator("{}", 0);
  const NominalMotion motion = swing_up_motion(.005);
  const MotionRegulator along({}, motion, refined, sim::kSwingUpDurationS, upright);
  ASSERT_TRUE(along.is_finite());
  for (const double t : {0., .3333, 1.1, 2.2}) {
    EXPECT_EQ(along.correction(t, sim::to_state(motion.state(t))), 0) << t;
  }
  // The motion ends close to rest, where its derivatives are those of rest.
  const sim::StateVector beside = motion.state(2.2) + sim::StateVector::Constant(.01);
  EXPECT_NEAR(along.correction(2.2, sim::to_state(beside)), -.01 * upright.gains().sum(), .2);
}

/// Alone the acceleration misses upright from a start beside that of the motion; with feedback it
/// ends where the motion does.
TEST(MotionRegulatorTest, BringsAStartBesideTheMotionBackToIt) {
  const RestRegulator upright = regulator("{}", 0);
  const NominalMotion motion = swing_up_motion(.005);
  const MotionRegulator along({}, motion, refined, sim::kSwingUpDurationS, upright);
  const auto miss = [&](bool with_feedback) {
    sim::CartPendulumState start = sim::kHanging;
    start.phi1 += .02;
    start.phi2 -= .02;
    const auto input = [&](double t, const sim::CartPendulumState& state) {
      return refined(t) + (with_feedback ? along.correction(t, state) : 0);
    };
    const auto end =
        sim::Rk4Plant({}, .005).simulate(start, sim::kSwingUpDurationS, input, sim::go_on);
    return (sim::to_vector(*end) - motion.state(sim::kSwingUpDurationS)).norm();
  };
  EXPECT_GT(miss(false), .5);
  EXPECT_LT(miss(true), .05);
}

}  // namespace
}  // namespace treeroll
