#include <gtest/gtest.h>
#include <ode/ode.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/dopri5_plant.h"
#include "sim/ode_guard.h"
#include "sim/ode_plant.h"
#include "sim/rk4_plant.h"
#include "tests/sim/swing_up_input.h"

namespace treeroll::sim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

CartAcceleration constant(double acceleration) {
  return [acceleration](double, const CartPendulumState&) { return acceleration; };
}

/// What every plant owes its callers, whatever is inside.
class PlantContractTest : public ::testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<CartPendulumPlant> plant() const {
    if (GetParam() == "ode") return std::make_unique<OdePlant>(DoublePendulum{}, 1e-3);
    if (GetParam() == "rk4") return std::make_unique<Rk4Plant>(DoublePendulum{}, 1e-3);
    return std::make_unique<Dopri5Plant>(DoublePendulum{}, Dopri5Settings{});
  }
};

TEST_P(PlantContractTest, VisitsTheStartAndEveryStepAndShortensTheLast) {
  std::vector<double> times;
  CartPendulumState last;
  const auto end = plant()->simulate(kHanging, .0105, constant(1),
                                     [&](double time_s, const CartPendulumState& s, double input) {
                                       times.push_back(time_s);
                                       last = s;
                                       EXPECT_EQ(input, 1);
                                       return true;
                                     });
  ASSERT_TRUE(end);
  ASSERT_EQ(times.size(), 12U);
  EXPECT_EQ(times.front(), 0);
  EXPECT_EQ(times[3], 3 * 1e-3);
  EXPECT_EQ(times.back(), .0105);
  EXPECT_EQ(*end, last);
  EXPECT_NEAR(end->y_rate, .0105, 1e-12);
}

TEST_P(PlantContractTest, VisitsOnlyTheStartIfThereIsNoDuration) {
  int visits = 0;
  const auto end =
      plant()->simulate(kHanging, 0, constant(1), [&](double, const CartPendulumState&, double) {
        ++visits;
        return true;
      });
  ASSERT_TRUE(end);
  EXPECT_EQ(*end, kHanging);
  EXPECT_EQ(visits, 1);
}

TEST_P(PlantContractTest, EndsWhereTheVisitorSaysSo) {
  const auto end = plant()->simulate(
      {}, 1, constant(2),
      [](double time_s, const CartPendulumState&, double) { return time_s < .1; });
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->y_rate, .2, 1e-9);
}

TEST_P(PlantContractTest, RepeatsBitForBitWhateverWasSimulatedBefore) {
  const auto input = feed_forward(kPublished);
  const auto first = plant()->simulate(kHanging, 2.5, input, go_on);
  const auto used = plant();
  (void)used->simulate({.phi1 = 1, .phi2_rate = 3}, .7, constant(4), go_on);
  (void)used->simulate(kHanging, 1, constant(1e200), go_on);
  const auto again = used->simulate(kHanging, 2.5, input, go_on);
  ASSERT_TRUE(first);
  ASSERT_TRUE(again);
  EXPECT_EQ(*first, *again);
}

TEST_P(PlantContractTest, StartsFromAnyStateWithItsRates) {
  const CartPendulumState start{
      .phi1 = 7, .phi2 = -9, .y = .3, .phi1_rate = 2, .phi2_rate = -1, .y_rate = .5};
  const auto end = plant()->simulate(start, 1e-3, constant(0), go_on);
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->phi1, 7.002, 1e-4);  // unwrapped: not 7 - 2 pi
  EXPECT_NEAR(end->phi2, -9.001, 1e-4);
  EXPECT_NEAR(end->y, .3005, 1e-9);
  EXPECT_NEAR(end->phi1_rate, 2, .1);
  EXPECT_NEAR(end->phi2_rate, -1, .1);
}

TEST_P(PlantContractTest, AnswersAnInfiniteInputWithAnError) {
  const auto late = [](double time_s, const CartPendulumState&) {
    return time_s < .05 ? 1. : kInfinity;
  };
  double last_s = 0;
  const auto end =
      plant()->simulate(kHanging, 1, late, [&](double time_s, const CartPendulumState&, double) {
        last_s = time_s;
        return true;
      });
  ASSERT_FALSE(end);
  EXPECT_NE(end.error().message.find("is not finite at 0.05"), std::string::npos)
      << end.error().message;
  EXPECT_LE(last_s, .05);
}

TEST_P(PlantContractTest, AnswersAnExplosionWithAnErrorAndShowsNoStateThatIsNotFinite) {
  for (const double acceleration : {1e100, 1e200, 1e308}) {
    const auto end = plant()->simulate(kHanging, 1, constant(acceleration),
                                       [](double, const CartPendulumState& s, double) {
                                         EXPECT_TRUE(is_finite(s));
                                         return true;
                                       });
    ASSERT_FALSE(end) << acceleration;
    EXPECT_FALSE(end.error().message.empty());
  }
}

TEST_P(PlantContractTest, AnswersAStartThatIsNotFiniteWithAnError) {
  EXPECT_FALSE(plant()->simulate({.phi1 = std::nan("")}, 1, constant(0), go_on));
  EXPECT_FALSE(plant()->simulate({.y_rate = kInfinity}, 1, constant(0), go_on));
}

TEST_P(PlantContractTest, LetsExceptionsOfInputAndVisitorPass) {
  const auto throwing = [](double, const CartPendulumState&) -> double {
    throw std::runtime_error("policy");
  };
  const auto used = plant();
  EXPECT_THROW((void)used->simulate(kHanging, 1, throwing, go_on), std::runtime_error);
  EXPECT_TRUE(used->simulate(kHanging, .1, constant(1), go_on));
}

INSTANTIATE_TEST_SUITE_P(Plants, PlantContractTest, ::testing::Values("ode", "rk4", "dopri5"),
                         [](const auto& plant) { return plant.param; });

TEST(Dopri5PlantTest, GivesUpAfterItsLargestNumberOfSteps) {
  Dopri5Plant plant({}, {.steps_max = 20});
  const auto end = plant.simulate(kHanging, 2.5, feed_forward(kPublished), go_on);
  ASSERT_FALSE(end);
  EXPECT_NE(end.error().message.find("more than 20 integrator steps"), std::string::npos);
}

TEST(Dopri5PlantTest, TheOutputStepDoesNotChangeTheMotion) {
  Dopri5Plant fine({}, {.output_step_s = 1e-3}), coarse({}, {.output_step_s = .1});
  const auto input = feed_forward(kPublished);
  EXPECT_EQ(*fine.simulate(kHanging, 2, input, go_on), *coarse.simulate(kHanging, 2, input, go_on));
}

TEST(OdeGuardTest, TurnsEveryReportOfOdeIntoAnErrorAndGoesOn) {
  initialise_ode();
  bool reached = false;
  const auto message = run_ode_guarded([&] {
    dMessage(3, "value %d", 7);
    reached = true;
  });
  ASSERT_TRUE(message);
  EXPECT_EQ(message->message, "ODE reported 3: value 7");
  EXPECT_TRUE(reached);

  const auto error = run_ode_guarded([] { dError(4, "broken"); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->message, "ODE reported 4: broken");
  const auto debug = run_ode_guarded([] { dDebug(5, "assertion"); });
  ASSERT_TRUE(debug);
  EXPECT_EQ(debug->message, "ODE reported 5: assertion");

  EXPECT_FALSE(run_ode_guarded([] {}));
}

}  // namespace
}  // namespace treeroll::sim
