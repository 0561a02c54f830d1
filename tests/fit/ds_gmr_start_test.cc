#include "learner/fit/ds_gmr_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/policy/ds_gmr/ds_gmr_policy.h"
#include "learner/fit/demonstration.h"
#include "tests/fit/read_start.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

double movement_error(const std::string& text) {
  const StartPolicy start = read_start(text);
  EXPECT_EQ(*start.demonstration, demonstrate({}));  // what was recorded, not the attractor
  return rms_error(*start.policy, *start.demonstration);
}

std::string flat_of(int components, const std::string& more = "") {
  return R"({"kind": "ds_gmr", "model": "flat", "components": [)" + std::to_string(components) +
         "]" + more + "}";
}

/// 1600 / s^2 by default, as an independent implementation has it.
TEST(DsGmrStartTest, MeetsTheSwingUpsDemonstration) {
  const StartPolicy start = read_start(flat_of(4));
  const auto& policy = dynamic_cast<const DsGmrPolicy&>(*start.policy);
  EXPECT_NEAR(policy.pull().stiffness, 1600, 1e-9);
  EXPECT_EQ(policy.pull().high, 2.2);
  EXPECT_EQ(policy.theta_dim(), 12);
  EXPECT_LT(movement_error(R"({"kind": "ds_gmr", "model": "flat", "components": "auto"})"),
            .1 * 5.83);
  EXPECT_LT(movement_error(R"({"kind": "ds_gmr", "model": "top_down_tree"})"), .12);
}

/// A program written from the equations alone comes to these errors, in m/s^2: plain expectation
/// maximisation, Levenberg-Marquardt by differences, Runge-Kutta of the spring. How near a movement
/// comes is a matter of where the fit of its attractor stops: at .02, or after 200 steps.
TEST(DsGmrStartTest, ComesAsNearAsAnIndependentImplementation) {
  const std::string softer = R"(, "stiffness": 400)";
  const std::string to_the_end = R"(, "fit": {"stop_relative_error": 0.0})";
  EXPECT_NEAR(movement_error(flat_of(4)), .0923, .001);
  EXPECT_NEAR(movement_error(flat_of(4, to_the_end)), .0392, .001);
  EXPECT_NEAR(movement_error(flat_of(4, softer)), .0681, .001);
  EXPECT_NEAR(movement_error(flat_of(4, softer + to_the_end)), .1597, .001);
  EXPECT_NEAR(movement_error(flat_of(3)), .3315, .001);
}

TEST(DsGmrStartTest, ResolvesToTheSamePolicyAndTakesAStoredOne) {
  json resolved;
  const StartPolicy start = read_start(R"({"kind": "ds_gmr"})", {}, &resolved);
  EXPECT_EQ(resolved["stiffness"], 1600);
  EXPECT_EQ(to_json(*read_start(resolved.dump()).policy), to_json(*start.policy));
  const StartPolicy stored{.policy = start.policy->with(2 * start.policy->theta()),
                           .log_likelihoods = {1, 2}};
  EXPECT_EQ(to_json(*read_start(resolved.dump(), {.fitted = &stored}).policy),
            to_json(*stored.policy));
  const StartPolicy tree = read_start(R"({"kind": "tree"})");
  EXPECT_THAT(refusal_of(resolved.dump(), {.fitted = &tree}), HasSubstr("its kind differs"));
}

/// Two recordings of two outputs, one of them without a number: a fit of both.
TEST(DsGmrStartTest, TakesSeveralRecordingsAndOutputs) {
  const auto read_file = [](const std::string& name) {
    std::string text = "t,x,y\n";
    for (int n = 0; n <= 40; ++n) {
      const double t = n / 20. + (name == "b" ? .01 : 0);
      text += std::to_string(t) + "," + std::to_string(std::sin(t)) + "," +
              (n == 20 && name == "a" ? "" : std::to_string(t * (2 - t))) + "\n";
    }
    return text;
  };
  const StartPolicy start = read_start(
      R"({"kind": "ds_gmr", "model": "flat", "components": [3], "demonstration": {"kind": "csv",
          "files": ["a", "b"], "inputs": ["t"], "outputs": ["x", "y"], "missing_outputs": true}})",
      {.read_file = read_file});
  EXPECT_EQ(start.policy->output_dim(), 2);
  const auto controller = start.policy->controller();
  for (const double t : {.5, 1., 1.7}) {
    double output[2];
    controller->act({&t, 1}, output);
    EXPECT_NEAR(output[0], std::sin(t), .05) << t;
    EXPECT_NEAR(output[1], t * (2 - t), .05) << t;
  }
}

TEST(DsGmrStartTest, StartsFromComponentsWithoutADemonstration) {
  json resolved;
  const StartPolicy start = read_start(
      R"({"kind": "ds_gmr", "start": "components", "range": [1, 3], "layout": "means",
          "layer_1": {"range": [1, 3], "outputs": [0, 0], "deviations": [0.5, 1]}})",
      {}, &resolved);
  EXPECT_EQ(start.policy->kind(), "ds_gmr");
  EXPECT_EQ(start.policy->theta_dim(), 4);
  EXPECT_EQ(resolved["stiffness"], 44 * 44);
  EXPECT_EQ(start.policy->controller()->act(2), 0);
}

/// Beside an offset that a parabola over the seam would take for an acceleration of thousands.
TEST(DsGmrStartTest, NoAccelerationIsSeenOverTheSeamOfTwoRecordings) {
  const auto read_file = [](double second_begins) {
    return [second_begins](const std::string& name) {
      std::string text = "t,x\n";
      for (int n = 0; n <= 40; ++n) {
        const double t = n / 20. + (name == "b" ? second_begins : 0);
        text += std::to_string(t) + "," + (name == "b" ? "7" : "1") + "\n";
      }
      return text;
    };
  };
  for (const double second_begins : {2., 2.5, -1., 0.}) {
    const StartPolicy start = read_start(
        R"({"kind": "ds_gmr", "model": "flat", "components": [2], "demonstration": {"kind": "csv",
            "files": ["a", "b"], "inputs": ["t"], "outputs": ["x"]}})",
        {.read_file = read_file(second_begins)});
    const auto& policy = dynamic_cast<const DsGmrPolicy&>(*start.policy);
    const auto attractor = policy.attractor()->controller();
    for (const double t : {-1., 0., 1., 2., 3., 4.}) {
      EXPECT_GT(attractor->act(t), 0) << t << " of " << second_begins;
      EXPECT_LT(attractor->act(t), 8) << t << " of " << second_begins;
    }
  }
}

/// Warped times stand still where the reference hurries on, and jump where it lingers.
TEST(DsGmrStartTest, TimeWarpingIsRefusedByName) {
  const auto read_file = [](const std::string& name) {
    std::string text = "t,x\n";
    for (int n = 0; n <= 200; ++n) {
      const double s = n / 200.;
      const double x = std::sin(2 * M_PI * (name == "b" ? s * std::sqrt(s) : s));
      text += std::to_string(2 * s) + "," + std::to_string(x) + "\n";
    }
    return text;
  };
  const auto refusal_with = [&](const std::string& align) {
    return refusal_of(R"({"kind": "ds_gmr", "model": "flat", "demonstration": {"kind": "csv",
                          "files": ["a", "b"], "inputs": ["t"], "outputs": ["x"], "align": ")" +
                          align + R"("}})",
                      {.read_file = read_file});
  };
  EXPECT_THAT(refusal_with("dynamic_time_warping"),
              HasSubstr("policy.demonstration.align: of this kind of policy must be \"none\" or"));
  EXPECT_EQ(refusal_with("duration"), "accepted");
}

/// By default no stiffness is a number there, and the root times the duration may round to either
/// side of a bound.
TEST(DsGmrStartTest, TakesOrRefusesEveryRange) {
  const auto text_of = [](double duration, const std::string& more) {
    const std::string range = "[0, " + json(duration).dump() + "]";
    return R"({"kind": "ds_gmr", "start": "components", "layout": "means", "range": )" + range +
           R"(, "layer_1": {"range": [0, 1], "outputs": [0, 0], "deviations": [0.25, 1]})" + more +
           "}";
  };
  for (const double duration : {1e-160, 1e200}) {
    EXPECT_THAT(refusal_of(text_of(duration, "")),
                HasSubstr("policy.stiffness: its root times the duration must be 1 to 1e5"));
  }
  int num_taken = 0;
  for (int duration = 1; duration <= 120; ++duration) {
    for (const double strength : {1., 1e5}) {
      const double root = strength / duration;
      try {
        read_start(text_of(duration, R"(, "stiffness": )" + json(root * root).dump()));
        ++num_taken;
      } catch (const ConfigError& error) {
        EXPECT_EQ(error.key(), "policy.stiffness");
      }
    }
  }
  EXPECT_GT(num_taken, 200);
}

TEST(DsGmrStartTest, RefusesWhatIsNoMovement) {
  const auto csv = [](const char* text) {
    return refusal_of(R"({"kind": "ds_gmr", "components": [1, 2], "demonstration": {"kind": "csv",
                          "files": ["a"], "inputs": ["t"], "outputs": ["x"]}})",
                      {.read_file = [text](const std::string&) { return std::string(text); }});
  };
  EXPECT_THAT(csv("t,x\n0,1\n1,2\n1,3\n2,3\n"),
              HasSubstr("does not rise or leaves a gap of more than 5 median steps: the one that "
                        "begins with sample 1 has 2"));
  EXPECT_THAT(csv("t,x\n0,1\n1,2\n2,3\n0,3\n1,4\n"),
              HasSubstr("the one that begins with sample 4 has 2"));
  EXPECT_THAT(csv("t,x\n0,1\n1e-200,2\n2e-200,5\n"), HasSubstr("does not vary"));
  EXPECT_THAT(refusal_of(R"({"kind": "ds_gmr", "stiffness": 0.1})"), HasSubstr("policy.stiffness"));
  EXPECT_THAT(refusal_of(R"({"kind": "ds_gmr", "stiffness": 1e11})"),
              HasSubstr("policy.stiffness"));
  EXPECT_THAT(refusal_of(R"({"kind": "ds_gmr", "start": "components",
                             "layer_1": {"range": [1, 3], "outputs": [0], "deviations": [1, 1]}})"),
              HasSubstr("policy.range: is required"));
  EXPECT_THAT(refusal_of(R"({"kind": "ds_gmr", "start": "components", "range": [0, 1], "layer_1":
                             {"inputs": 2, "means": [[0, 0, 0]], "deviations": [1, 1, 1]}})"),
              HasSubstr("must have one input"));
  EXPECT_THAT(refusal_of(R"({"kind": "tree", "stiffness": 100})"), HasSubstr("policy.stiffness"));
}

}  // namespace
}  // namespace treeroll
