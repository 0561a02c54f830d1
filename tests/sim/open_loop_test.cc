#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/numbers/processor.h"
#include "common/numbers/random_stream.h"
#include "sim/dopri5_plant.h"
#include "sim/ode_plant.h"
#include "sim/rk4_lanes.h"
#include "sim/rk4_plant.h"

namespace treeroll::sim {
namespace {

constexpr double kStepS = 5e-3;
constexpr double kDurationS = .303;  // the last step is shorter

/// A roll-out with its inputs, as simulate_open_loop() takes it.
struct Case {
  CartPendulumState start;
  std::vector<double> accelerations;
};

std::vector<Case> cases(std::size_t count, std::size_t num_inputs) {
  std::vector<Case> all;
  for (std::uint32_t i = 0; i < count; ++i) {
    RandomStream random(4, i, 0, RandomPurpose::kPopulation);
    Case& one = all.emplace_back();
    one.start = {.phi1 = 3 * random.next_normal(),
                 .phi2 = 3 * random.next_normal(),
                 .y = random.next_normal(),
                 .phi1_rate = 5 * random.next_normal(),
                 .phi2_rate = 5 * random.next_normal(),
                 .y_rate = random.next_normal()};
    for (std::size_t k = 0; k < num_inputs; ++k) {
      one.accelerations.push_back(10 * random.next_normal());
    }
  }
  return all;
}

/// What was seen of one roll-out.
struct Seen {
  std::vector<double> times_s;
  std::vector<CartPendulumState> states;
  std::vector<double> inputs;
  bool operator==(const Seen&) const = default;
};

class OpenLoopTest : public ::testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<CartPendulumPlant> plant() const {
    if (GetParam() == "ode") return std::make_unique<OdePlant>(DoublePendulum{}, kStepS);
    return std::make_unique<Rk4Plant>(DoublePendulum{}, kStepS);
  }
};

/// With as many beside it as there may be: all widths, some full and some not.
TEST_P(OpenLoopTest, GivesTheBitsOfSimulate) {
  const auto plant = this->plant();
  const std::vector<double> times = plant->input_times(kDurationS);
  const std::vector<Case> all = cases(19, times.size());
  std::vector<Seen> alone(all.size());
  std::vector<CartPendulumState> ends;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto input = [&](double time_s, const CartPendulumState&) {
      for (std::size_t k = 0; k < times.size(); ++k) {
        if (times[k] == time_s) return all[i].accelerations[k];
      }
      ADD_FAILURE() << time_s << " is none of input_times()";
      return 0.;
    };
    const auto end = plant->simulate(all[i].start, kDurationS, input,
                                     [&](double t, const CartPendulumState& s, double u) {
                                       alone[i].times_s.push_back(t);
                                       alone[i].states.push_back(s);
                                       alone[i].inputs.push_back(u);
                                       return true;
                                     });
    ASSERT_TRUE(end);
    ends.push_back(*end);
  }
  for (std::size_t count = 0; count <= all.size(); ++count) {
    std::vector<OpenLoop> rollouts;
    for (std::size_t i = 0; i < count; ++i) {
      rollouts.push_back({.start = all[i].start, .accelerations = all[i].accelerations});
    }
    std::vector<Seen> seen(count);
    const auto together = plant->simulate_open_loop(
        rollouts, kDurationS, [&](std::size_t i, double t, const CartPendulumState& s, double u) {
          seen.at(i).times_s.push_back(t);
          seen.at(i).states.push_back(s);
          seen.at(i).inputs.push_back(u);
        });
    ASSERT_EQ(together.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_TRUE(together[i]);
      EXPECT_EQ(*together[i], ends[i]) << i << " of " << count;
      EXPECT_TRUE(seen[i] == alone[i]) << i << " of " << count;
    }
  }
}

TEST_P(OpenLoopTest, OneThatDivergesDoesNotTouchItsNeighbours) {
  const auto plant = this->plant();
  std::vector<Case> all = cases(8, plant->input_times(kDurationS).size());
  std::vector<OpenLoop> rollouts;
  for (const Case& one : all) {
    rollouts.push_back({.start = one.start, .accelerations = one.accelerations});
  }
  const auto ignore = [](std::size_t, double, const CartPendulumState&, double) {};
  const auto before = plant->simulate_open_loop(rollouts, kDurationS, ignore);
  all[1].accelerations[20] = std::numeric_limits<double>::quiet_NaN();
  all[4].accelerations[11] = 1e300;
  rollouts[6].start.phi1 = std::numeric_limits<double>::infinity();
  const auto after = plant->simulate_open_loop(
      rollouts, kDurationS, [](std::size_t, double, const CartPendulumState& s, double u) {
        EXPECT_TRUE(is_finite(s) && std::isfinite(u));
      });
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_TRUE(before[i]);
    if (i == 1 || i == 4 || i == 6) {
      ASSERT_FALSE(after[i]) << i;
      const auto alone =
          plant->simulate_open_loop(std::span(rollouts).subspan(i, 1), kDurationS, ignore);
      ASSERT_FALSE(alone[0]);
      EXPECT_EQ(after[i].error().message, alone[0].error().message);
    } else {
      ASSERT_TRUE(after[i]) << i;
      EXPECT_EQ(*after[i], *before[i]) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Plants, OpenLoopTest, ::testing::Values("ode", "rk4"),
                         [](const auto& plant) { return plant.param; });

TEST(OpenLoopTest, InputTimesOfStepControlAreNotKnown) {
  EXPECT_TRUE(Dopri5Plant(DoublePendulum{}, Dopri5Settings{}).input_times(1).empty());
}

/// Each width that this processor has, also those that are not the widest.
TEST(Rk4LanesTest, EveryWidthGivesTheBitsOfOne) {
  const std::pair<int, Rk4LaneStep> widths[] = {
      {2, &rk4_step_2}, {4, &rk4_step_4}, {8, &rk4_step_8}};
  for (const auto& [width, step] : widths) {
    if (width > widest_lanes()) continue;
    const auto count = static_cast<std::size_t>(width);
    const std::vector<Case> all = cases(count, 3);
    std::vector<double> inputs(3 * count), states(6 * count);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const CartPendulumState& s = all[lane].start;
      const double numbers[] = {s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate};
      for (std::size_t i = 0; i < 6; ++i) states[i * count + lane] = numbers[i];
      for (std::size_t i = 0; i < 3; ++i) inputs[i * count + lane] = all[lane].accelerations[i];
    }
    step(DoublePendulum{}, kStepS, inputs.data(), states.data());
    Rk4Plant plant(DoublePendulum{}, kStepS);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const OpenLoop alone = {.start = all[lane].start, .accelerations = all[lane].accelerations};
      const auto end = plant.simulate_open_loop(
          {&alone, 1}, kStepS, [](std::size_t, double, const CartPendulumState&, double) {});
      ASSERT_TRUE(end[0]);
      const CartPendulumState got = {states[lane],
                                     states[count + lane],
                                     states[2 * count + lane],
                                     states[3 * count + lane],
                                     states[4 * count + lane],
                                     states[5 * count + lane]};
      EXPECT_EQ(got, *end[0]) << "lane " << lane << " of " << width;
    }
  }
}

}  // namespace
}  // namespace treeroll::sim
