#include "workers/tasks/trajectory_task.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/mixture/gmr.h"
#include "common/settings/settings_reader.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// Components at the middles of equal parts of [0, duration], each on a line of its own.
Gmm equally_spaced_lines(double duration, const std::vector<Eigen::VectorXd>& outputs,
                         const std::vector<double>& slopes) {
  std::vector<Component> components;
  const double share = duration / static_cast<double>(outputs.size());
  const Eigen::Index dim = 1 + outputs[0].size();
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    Component c{1, Eigen::VectorXd(dim), Eigen::MatrixXd::Identity(dim, dim)};
    c.mean << share * (static_cast<double>(k) + .5), outputs[k];
    const double variance = share * share / 4;
    c.covariance(0, 0) = variance;
    for (Eigen::Index o = 1; o < dim; ++o) {
      c.covariance(o, 0) = c.covariance(0, o) = slopes[k] * variance;
    }
    components.push_back(std::move(c));
  }
  return Gmm(1, std::move(components));
}

Eigen::VectorXd one(double value) { return Eigen::VectorXd::Constant(1, value); }

constexpr const char* kMulti = R"("goal": {"outputs": [1.25, 0.75, -0.75, -1.25],
                                           "deviations": [0.25, 0.3]})";

Gmm multi(double offset) {
  return equally_spaced_lines(
      2, {one(1.25 + offset), one(.75 + offset), one(-.75 + offset), one(-1.25 + offset)},
      {0, 0, 0, 0});
}

TEST(TrajectoryTaskTest, TheGoalItselfGetsRewardOne) {
  const auto task = standard_task("trajectory", std::string("{") + kMulti + "}");
  EXPECT_NEAR(evaluate(*task, multi(0), 0).reward(), 1, 1e-15);
}

TEST(TrajectoryTaskTest, AConstantOffsetGetsTheRewardOfItsSquare) {
  for (const double alpha : {20., 3.}) {
    const auto task =
        standard_task("trajectory", "{\"alpha\": " + std::to_string(alpha) + ", " + kMulti + "}");
    for (const double offset : {.1, -.3, 1.}) {
      EXPECT_NEAR(evaluate(*task, multi(offset), 0).reward(), std::exp(-alpha * offset * offset),
                  1e-13);
    }
  }
}

TEST(TrajectoryTaskTest, TheSlopeOfAGoalIsPsiOverZeta) {
  // Experiment II: over 4 s a deviation of .5 s, so that psi .3 is a slope of .6 per s.
  const auto task = standard_task("trajectory", R"({"duration_s": 4, "goal": {
      "outputs": [1.25, 0.75, -0.75, -1.25], "psi": [0.3, 0.3, -0.3, -0.3],
      "deviations": [0.5, 0.3]}})");
  const Gmm policy =
      equally_spaced_lines(4, {one(1.25), one(.75), one(-.75), one(-1.25)}, {.6, .6, -.6, -.6});
  EXPECT_NEAR(evaluate(*task, policy, 0).reward(), 1, 1e-13);
}

TEST(TrajectoryTaskTest, ALineAgainstALineGetsTheMeanOfTheSquaresAtTheSamples) {
  // One component with slope 1 through 0 against the constant 0: the squares of the sample times.
  const auto task = standard_task("trajectory", R"({"duration_s": 3, "samples": 7, "alpha": 0.2,
      "goal": {"means": [[0, 0]], "deviations": [1, 1]}})");
  Eigen::Matrix2d covariance;
  covariance << 1, 1, 1, 2;
  double sum = 0;
  for (int i = 0; i < 7; ++i) sum += std::pow(3 * (i + .5) / 7, 2);
  EXPECT_NEAR(evaluate(*task, Gmm(1, {{1, Eigen::Vector2d(0, 0), covariance}}), 0).reward(),
              std::exp(-.2 * sum / 7), 1e-14);
}

TEST(TrajectoryTaskTest, SeveralOutputsAddTheirSquares) {
  const auto task = standard_task("trajectory", R"({"alpha": 2, "goal": {
      "outputs": [[1, 2, 3], [4, 5, 6]], "deviations": [0.5, 1, 1, 1]}})");
  EXPECT_EQ(task->description().output_dim, 3);
  const Eigen::Vector3d offset(.1, -.2, .3);
  const Gmm policy = equally_spaced_lines(
      2, {Eigen::Vector3d(1, 2, 3) + offset, Eigen::Vector3d(4, 5, 6) + offset}, {0, 0});
  EXPECT_NEAR(evaluate(*task, policy, 0).reward(), std::exp(-2 * (.01 + .04 + .09)), 1e-14);
}

TEST(TrajectoryTaskTest, DescribesItselfAndSaysWhatIsWrong) {
  const TaskDescription d =
      standard_task("trajectory", std::string(R"({"time_limit_s": 3, )") + kMulti + "}")
          ->description();
  EXPECT_EQ(d.input_dim, 1);
  EXPECT_EQ(d.output_dim, 1);
  EXPECT_EQ(d.reward_max, 1);
  EXPECT_EQ(d.time_limit_s, 3);
  EXPECT_TRUE(d.deterministic);
  const std::pair<const char*, const char*> cases[] = {
      {"{}", "task.goal.means: is required"},
      {R"({"goal": 1})", "task.goal = 1: must be a table"},
      {R"({"goal": {"inputs": 2, "means": [[0, 0, 0]], "deviations": [1, 1, 1]}})",
       "task.goal.inputs = 2: must be 1"},
      {R"({"goal": {"means": [[0, 0]], "deviations": [1, 1], "colour": 1}})", "task.goal.colour"},
      {R"({"samples": 0})", "task.samples"},
      {R"({"alpha": -1})", "task.alpha"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_THAT(refusal("trajectory", text), HasSubstr(message)) << text;
  }
}

/// Lines so short that they are the circle's tangents.
Gmm circle(Eigen::Vector2d offset) {
  constexpr int kNum = 2000;
  const double share = 5 * M_PI / kNum, variance = share * share / 4;
  std::vector<Component> components;
  for (int k = 0; k < kNum; ++k) {
    const double t = (k + .5) * share;
    Component c{1, Eigen::Vector3d(t, std::sin(t) + offset[0], std::cos(t) + offset[1]),
                Eigen::Matrix3d::Identity()};
    c.covariance(0, 0) = variance;
    c.covariance(0, 1) = c.covariance(1, 0) = std::cos(t) * variance;
    c.covariance(0, 2) = c.covariance(2, 0) = -std::sin(t) * variance;
    components.push_back(std::move(c));
  }
  return Gmm(1, std::move(components));
}

TEST(SpiralTaskTest, TheCircleItselfGetsRewardOneAndAnOffsetItsSquare) {
  const auto task = standard_task("spiral", "{}");
  EXPECT_NEAR(evaluate(*task, circle({0, 0}), 0).reward(), 1, 1e-8);
  EXPECT_NEAR(evaluate(*task, circle({.1, -.2}), 0).reward(), std::exp(-5 * .05), 1e-6);
}

TEST(SpiralTaskTest, APolicyThatStaysInTheMiddleGetsTheRewardOfTheRadius) {
  const Gmm middle(1, {{1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()}});
  EXPECT_NEAR(evaluate(*standard_task("spiral", "{}"), middle, 0).reward(), std::exp(-5), 1e-15);
  EXPECT_NEAR(
      evaluate(*standard_task("spiral", R"({"alpha": 1, "duration": 1, "samples": 3})"), middle, 0)
          .reward(),
      std::exp(-1), 1e-15);
}

TEST(SpiralTaskTest, DescribesItselfAndSaysWhatIsWrong) {
  const TaskDescription d = standard_task("spiral", "{}")->description();
  EXPECT_EQ(d.input_dim, 1);
  EXPECT_EQ(d.output_dim, 2);
  EXPECT_TRUE(d.deterministic);
  EXPECT_THAT(refusal("spiral", R"({"duration": 0})"), HasSubstr("task.duration = 0"));
  EXPECT_THAT(refusal("spiral", R"({"goal": {}})"), HasSubstr("task.goal"));
}

TEST(RecordedGoalTest, EachRowIsASampleAndTheNamesAreThoseOfTheRecording) {
  // A policy that gives 1 everywhere, against 1, 2 and 4: (0 + 1 + 9) / 3.
  const auto task =
      standard_task("trajectory", R"({"alpha": 0.3, "goal": {"columns": ["t_ms", "x_mm"],
      "rows": [[0, 1], [10, 2], [30, 4]]}})");
  Trace trace;
  const Gmm policy = equally_spaced_lines(30, {one(1)}, {0});
  EXPECT_NEAR(evaluate_traced(*task, policy, 0, trace).reward(), std::exp(-1), 1e-12);
  EXPECT_EQ(trace.columns(), (std::vector<std::string>{"t_ms", "x_mm", "goal_x_mm"}));
  EXPECT_EQ(trace.numbers(), (std::vector<double>{0, 1, 1, 10, 1, 2, 30, 1, 4}));
}

TEST(RecordedGoalTest, RefusalsNameTheKeyAndTheRule) {
  const auto error = [](const std::string& goal) {
    return refusal("trajectory", "{\"goal\": {" + goal + "}}");
  };
  EXPECT_THAT(error(R"("columns": ["t"], "rows": [[0], [1]])"),
              HasSubstr("goal.columns = [\"t\"]: must name the time and at least one output"));
  EXPECT_THAT(error(R"("columns": ["t", "x", "x"], "rows": [[0, 1, 1]])"),
              HasSubstr("must differ"));
  EXPECT_THAT(error(R"("columns": ["t", "x", "goal_x"], "rows": [[0, 1, 1]])"),
              HasSubstr("goal_NAME"));
  EXPECT_THAT(error(R"("columns": ["t", "x"], "rows": [[0, 1], [0, 2]])"),
              HasSubstr("the time must grow: row 2 is at 0, the one before at 0"));
  EXPECT_THAT(error(R"("columns": ["t", "x"], "rows": [[0, 1, 2]])"), HasSubstr("goal.rows"));
  EXPECT_THAT(refusal("trajectory", R"({"samples": 5, "goal": {"columns": ["t", "x"],
      "rows": [[0, 1], [1, 2]]}})"),
              HasSubstr("samples"));
}

}  // namespace
}  // namespace treeroll
