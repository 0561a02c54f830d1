#include "workers/tasks/trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/numbers/elementary.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"
#include "workers/tasks/task.h"

namespace treeroll {
namespace {

using nlohmann::json;

TEST(TraceTest, TheLeastCostOfASwingUpsTraceGivesItsRewardToTheBit) {
  for (const char* settings : {R"({"plant": "ode"})", R"({"plant": "rk4", "step_s": 0.005})",
                               R"({"plant": "dopri5", "output_step_s": 0.01})"}) {
    const auto task = standard_task("swing_up", settings);
    Trace trace;
    const Outcome traced = evaluate_traced(*task, line(3, -2), 0, trace);
    EXPECT_EQ(traced.reward(), evaluate(*task, line(3, -2), 0).reward()) << settings;
    const std::size_t width = trace.columns().size();
    ASSERT_EQ(width, 9U);
    ASSERT_EQ(trace.numbers().size() % width, 0U);
    const auto at = [&](std::size_t row, std::size_t column) {
      return trace.numbers()[row * width + column];
    };
    const std::size_t num_rows = trace.numbers().size() / width;
    double cost_min = at(0, 8);
    for (std::size_t row = 1; row < num_rows; ++row) {
      cost_min = std::min(cost_min, at(row, 8));
      EXPECT_GT(at(row, 0), at(row - 1, 0)) << "time goes on";
      EXPECT_NEAR(at(row, 7), 3 - 2 * at(row, 0), 1e-9) << "the input is the policy's";
    }
    EXPECT_EQ(elementary::exp(-.25 * cost_min), traced.reward()) << settings;
    EXPECT_EQ(at(0, 1), -M_PI);
    EXPECT_NEAR(at(num_rows - 1, 0), 2.5, 1e-9);
  }
}

/// Whoever asks for terms alone gets the same ones, and no rows.
TEST(TraceTest, TheTermsOfASwingUpAddUpToItsLeastCost) {
  for (const char* settings :
       {R"({"plant": "rk4", "step_s": 0.005})", R"({"plant": "dopri5", "output_step_s": 0.01})"}) {
    const auto task = standard_task("swing_up", settings);
    Trace whole;
    Trace terms(Trace::Kept::kTerms);
    const double reward = evaluate_traced(*task, line(3, -2), 0, whole).reward();
    EXPECT_EQ(evaluate_traced(*task, line(3, -2), 0, terms).reward(), reward);
    EXPECT_EQ(terms.terms(), whole.terms());
    EXPECT_TRUE(terms.numbers().empty() && terms.poses().empty());
    EXPECT_FALSE(whole.numbers().empty());
    const double cost = terms.terms().at("least_cost");
    EXPECT_EQ(elementary::exp(-.25 * cost), reward);
    EXPECT_EQ(terms.terms().at("least_cost_angles") + terms.terms().at("least_cost_cart") +
                  terms.terms().at("least_cost_rates"),
              cost);
    // Where the trace has its least cost.
    const double time_s = terms.terms().at("least_cost_time_s");
    for (std::size_t row = 0; row < whole.numbers().size(); row += 9) {
      if (whole.numbers()[row] == time_s) {
        EXPECT_EQ(whole.numbers()[row + 8], cost);
      }
      EXPECT_GE(whole.numbers()[row + 8], cost);
    }
  }
}

TEST(TraceTest, TheTermsOfHoldingAddUpToItsMeanCost) {
  const auto task = standard_task("hold", R"({"plant": "rk4", "step_s": 0.005})");
  Trace trace(Trace::Kept::kTerms);
  const Gmm nothing(6, {{1, Eigen::VectorXd::Zero(7), Eigen::MatrixXd::Identity(7, 7)}});
  const double reward = evaluate_traced(*task, nothing, 0, trace).reward();
  const double cost = trace.terms().at("mean_cost");
  EXPECT_EQ(elementary::exp(-10 * cost), reward);
  EXPECT_NEAR(trace.terms().at("mean_cost_angles") + trace.terms().at("mean_cost_cart") +
                  trace.terms().at("mean_cost_rates"),
              cost, 1e-12 * cost);
}

TEST(TraceTest, TermsHaveNamesAndAreBounded) {
  Trace trace;
  trace.set_term("effort", 1);
  trace.set_term("effort", 2);
  EXPECT_EQ(trace.terms().at("effort"), 2);
  EXPECT_THROW(trace.set_term("", 1), std::invalid_argument);
  EXPECT_THROW(trace.set_term(std::string(65, 'x'), 1), std::invalid_argument);
  for (int i = 1; i < 64; ++i) trace.set_term(std::to_string(i), i);
  EXPECT_THROW(trace.set_term("one more", 1), std::invalid_argument);
  trace.set_term("63", 0);
  EXPECT_EQ(trace.terms().size(), 64U);
}

TEST(TraceTest, ADivergedSwingUpIsTracedAsFarAsItWent) {
  const auto task = standard_task("swing_up", R"({"plant": "dopri5", "steps_max": 100})");
  Trace trace;
  EXPECT_EQ(evaluate_traced(*task, line(3, -2), 0, trace).status(), RolloutStatus::kDiverged);
  EXPECT_GT(trace.numbers().size(), 0U);
}

TEST(TraceTest, TheSignalsOfEachTaskAreColumnsOfItsTrace) {
  const std::vector<std::pair<std::string, std::string>> tasks = {
      {"hold", "{}"},
      {"hold", R"({"feedback": "lqr"})"},
      {"spiral", "{}"},
      {"swing_up", "{}"},
      {"swing_up", R"({"feedback": "lqr"})"},
      {"track", "{}"},
      {"trajectory", R"({"goal": {"outputs": [0, 1], "deviations": [0.3, 0.3]}})"},
      {"trajectory", R"({"goal": {"columns": ["t_s", "x_m"], "rows": [[0, 1], [1, 2]]}})"}};
  for (const auto& [name, settings] : tasks) {
    const auto task = standard_task(name, settings);
    const TaskDescription description = task->description();
    ASSERT_FALSE(description.signals.empty()) << name;
    EXPECT_EQ(fault_of(description.signals, description.input_dim, description.output_dim),
              std::nullopt);
    Trace trace;
    const int dim = description.input_dim + description.output_dim;
    const Gmm nothing(description.input_dim, {{.prior = 1,
                                               .mean = Eigen::VectorXd::Zero(dim),
                                               .covariance = Eigen::MatrixXd::Identity(dim, dim)}});
    const Outcome outcome = evaluate_traced(*task, nothing, 0, trace);
    EXPECT_EQ(trace.policy_inputs(), description.signals.inputs) << name << outcome.reason();
    EXPECT_EQ(trace.policy_outputs(), description.signals.outputs) << name;
  }
  // A goal from a file may call its columns anything: then they are no signals.
  const auto odd = standard_task(
      "trajectory", R"({"goal": {"columns": ["t", "x in m"], "rows": [[0, 1], [1, 2]]}})");
  EXPECT_TRUE(odd->description().signals.empty());
  EXPECT_TRUE(standard_task("synthetic", "{}")->description().signals.empty());
}

TEST(TraceTest, ATaskThatDoesNotOverrideItRecordsNothing) {
  const auto task = standard_task("synthetic", "{}");
  Trace trace;
  EXPECT_EQ(evaluate_traced(*task, line(3, -2), 0, trace).reward(),
            evaluate(*task, line(3, -2), 0).reward());
  EXPECT_TRUE(trace.columns().empty());
  EXPECT_TRUE(trace.is_complete());
}

TEST(TraceTest, MoreNumbersThanItMayHoldAreNotKeptAndItSaysSo) {
  Trace trace;
  trace.set_columns({"time_s", "cost"});
  for (std::size_t row = 0; row < Trace::kNumbersMax / 2; ++row) trace.add_row({0, 1});
  EXPECT_TRUE(trace.is_complete());
  trace.add_row({0, 1});
  EXPECT_FALSE(trace.is_complete());
  EXPECT_EQ(trace.numbers().size(), Trace::kNumbersMax);
}

TEST(TraceTest, TheLinksOfASwingUpKeepTheirLengthsAndHangFromTheCart) {
  const auto task = standard_task("swing_up", R"({"plant": "rk4", "step_s": 0.005})");
  Trace trace;
  (void)evaluate_traced(*task, line(3, -2), 0, trace);
  const std::size_t width = trace.columns().size();
  ASSERT_EQ(trace.poses().size() * width, trace.numbers().size());
  for (std::size_t row = 0; row < trace.poses().size(); ++row) {
    const double* state = &trace.numbers()[row * width];
    const std::vector<PosePoint>& links = trace.poses()[row].at(1);
    ASSERT_EQ(links.size(), 3U);
    EXPECT_EQ(links[0].x_m, state[3]);
    EXPECT_NEAR(std::hypot(links[1].x_m - links[0].x_m, links[1].y_m - links[0].y_m), .323, 1e-12);
    EXPECT_NEAR(std::hypot(links[2].x_m - links[1].x_m, links[2].y_m - links[1].y_m), .480, 1e-12);
    // Counter-clockwise from upright is to the left.
    EXPECT_NEAR(links[0].x_m - links[1].x_m, .323 * std::sin(state[1]), 1e-12);
  }
}

TEST(TraceTest, LinksWhoseLengthsVaryAreNotShown) {
  const auto task = standard_task("swing_up", R"({"plant": "rk4", "step_s": 0.005,
      "variation": {"parameter_fraction": 0.02}})");
  Trace trace;
  (void)evaluate_traced(*task, line(3, -2), 0, trace);
  EXPECT_FALSE(trace.numbers().empty());
  EXPECT_TRUE(trace.poses().empty());
}

TEST(TraceTest, ATrajectorysTraceHasItsGoalBesideItAndGivesItsReward) {
  struct Case {
    const char* task;
    const char* settings;
    std::vector<std::string> columns;
    double alpha;
  };
  for (const Case& c :
       std::vector<Case>{{"trajectory",
                          R"({"alpha": 2, "goal": {"outputs": [1, -1], "deviations": [0.5, 0.3]}})",
                          {"time_s", "x", "goal_x"},
                          2},
                         {"spiral", R"({"alpha": 3})", {"t", "x", "y", "goal_x", "goal_y"}, 3}}) {
    const auto task = standard_task(c.task, c.settings);
    const auto num_outputs = static_cast<std::size_t>(task->description().output_dim);
    const auto dim = static_cast<Eigen::Index>(1 + num_outputs);
    const Gmm policy(1, {{.prior = 1,
                          .mean = Eigen::VectorXd::Constant(dim, .5),
                          .covariance = Eigen::MatrixXd::Identity(dim, dim)}});
    Trace trace;
    const double reward = evaluate_traced(*task, policy, 0, trace).reward();
    EXPECT_EQ(reward, evaluate(*task, policy, 0).reward()) << c.task;
    EXPECT_EQ(trace.columns(), c.columns);
    EXPECT_EQ(trace.policy_inputs(), std::vector<std::string>{c.columns[0]});
    EXPECT_EQ(trace.policy_outputs().size(), num_outputs);
    const std::size_t width = trace.columns().size();
    ASSERT_EQ(trace.numbers().size(), 100 * width);
    double sum = 0;
    for (std::size_t i = 0; i < trace.numbers().size(); i += width) {
      for (std::size_t o = 1; o <= num_outputs; ++o) {
        const double miss = trace.numbers()[i + o] - trace.numbers()[i + num_outputs + o];
        sum += miss * miss;
      }
    }
    EXPECT_NEAR(std::exp(-c.alpha * sum / 100), reward, 1e-12) << c.task;
  }
}

TEST(TraceTest, OutputsOfATrajectoryAreNumbered) {
  const auto task = standard_task("trajectory", R"({"goal": {
      "means": [[0, 1, 2], [2, 1, 0]], "covariances": [1, 0, 1, 0, 0, 1]}})");
  const Gmm policy(
      1,
      {{.prior = 1, .mean = Eigen::Vector3d::Zero(), .covariance = Eigen::Matrix3d::Identity()}});
  Trace trace;
  (void)evaluate_traced(*task, policy, 0, trace);
  EXPECT_EQ(trace.columns(),
            (std::vector<std::string>{"time_s", "x1", "x2", "goal_x1", "goal_x2"}));
}

TEST(TraceTest, PosesCountAmongTheNumbers) {
  Trace trace;
  trace.set_columns({"time_s"});
  const Pose pose(1, std::vector<PosePoint>(Trace::kNumbersMax / 2));
  trace.add_row({0});
  trace.add_pose(pose);
  EXPECT_FALSE(trace.is_complete());
  EXPECT_TRUE(trace.poses().empty());
}

TEST(TraceDeathTest, EveryRowHasAPoseOrNoneHas) {
  Trace trace;
  trace.set_columns({"time_s"});
  EXPECT_DEATH(trace.add_pose({}), "every row has a pose");
  trace.add_row({0});
  trace.add_row({1});
  EXPECT_DEATH(trace.add_pose({}), "every row has a pose");
  EXPECT_DEATH(trace.set_policy_columns({"angle_rad"}, {}), "are columns of the trace");
}

TEST(TraceDeathTest, ARowHasANumberForEachColumn) {
  Trace trace;
  EXPECT_DEATH(trace.add_row({1}), "a number for each column");
  trace.set_columns({"time_s", "cost"});
  EXPECT_DEATH(trace.add_row({1}), "a number for each column");
}

}  // namespace
}  // namespace treeroll
