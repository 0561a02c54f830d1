// A kind of policy that no room knows goes all the way: JSON, a study, exploration, a worker's
// evaluator, a picture. It is registered here and nowhere else.
#include "tests/policy/polynomial/polynomial_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/content_hash.h"
#include "learner/explore/exploration.h"
#include "learner/report/figures/policy_plot.h"
#include "learner/study/study_file.h"
#include "tests/study/study_text.h"
#include "workers/app/evaluator.h"

namespace treeroll {
namespace {

using study_test::error_of;
using study_test::StudyText;
using ::testing::HasSubstr;
using ::testing::Not;

PolicyRegistry with_polynomials() {
  PolicyRegistry policies = learnable_policies();
  policies.add("polynomial", polynomial_from_content, read_polynomial_start);
  return policies;
}

/// A path over 2 s that falls and rises.
constexpr const char* kStudy = R"([study]
name = "polynomials"
rollouts = 300
[task]
name = "trajectory"
goal = {outputs = [1.25, -0.75, 0.75], deviations = [0.33, 0.3]}
alpha = 2.0
[policy]
kind = "polynomial"
degrees = [1, 3]
range = [0.0, 2.0]
[exploration]
noise_variance = [1.0]
initial_noise_factor = 0.3
[[conditions]]
name = "ladder"
)";

Study learnable_study(const std::string& text) {
  const StudyText file(text);
  return load_study(file.path(), {}, with_polynomials()).study;
}

TEST(PolynomialPolicyTest, RoundTripsThroughItsTextUnderItsName) {
  const PolicyRegistry policies = with_polynomials();
  const PolynomialPolicy policy({0, 2}, {0, 2}, Eigen::MatrixXd::Random(3, 3), 2);
  const std::string text = to_json(policy);
  EXPECT_THAT(text, HasSubstr(R"("kind":"polynomial")"));
  const Result<PolicyPtr> copy = policies.from_json(text);
  ASSERT_TRUE(copy) << copy.error().message;
  EXPECT_EQ(to_json(**copy), text);
  EXPECT_EQ((*copy)->theta(), policy.theta());
  EXPECT_THAT(
      learnable_policies().from_json(text).error().message,
      HasSubstr("$.kind must be one of: correction, dmp, ds_gmr, network, rbf, spline, tree"));

  nlohmann::json spoilt = nlohmann::json::parse(text);
  spoilt["degrees"] = {2, 2};
  EXPECT_THAT(policies.from_json(spoilt.dump()).error().message, HasSubstr("$.degrees[1] is 2"));
}

TEST(PolynomialPolicyTest, TheNextLayerActsAsTheOneBefore) {
  const PolynomialPolicy policy({1, 3}, {0, 2}, Eigen::MatrixXd::Zero(2, 4), 1);
  const Eigen::VectorXd theta = Eigen::Vector4d(1, 2, 3, 4);
  const NextLayer next = policy.next_layer(theta);
  EXPECT_EQ(next.policy->layer(), 2);
  EXPECT_EQ(next.policy->theta_dim(), 8);
  EXPECT_EQ(*next.project(theta), next.policy->theta());
  double acted[2], acts[2];
  const double time = .7;
  policy.with(theta)->controller()->act({&time, 1}, acted);
  next.policy->controller()->act({&time, 1}, acts);
  EXPECT_EQ(acted[0], acts[0]);
  EXPECT_EQ(acted[1], acts[1]);
}

TEST(PolynomialPolicyTest, AStudyNamesItAndItsResolvedFormDoesToo) {
  const StudyText file(kStudy);
  const LoadedStudy loaded = load_study(file.path(), {}, with_polynomials());
  const Condition& condition = loaded.study.conditions[0];
  EXPECT_EQ(condition.start->kind(), "polynomial");
  EXPECT_EQ(condition.exploration.last_layer, 2);
  check_task(loaded, 0, {.input_dim = 1, .output_dim = 1});
  const StudyText resolved(loaded.resolved.to_toml(""));
  EXPECT_EQ(load_study(resolved.path(), {}, with_polynomials()).resolved.to_toml(""),
            loaded.resolved.to_toml(""));

  const auto error_with = [](const PolicyRegistry& policies, const char* override) {
    return error_of(StudyText(kStudy),
                    [&](const auto& path) { (void)load_study(path, {override}, policies); });
  };
  EXPECT_THAT(error_with(with_polynomials(), "policy.degrees=[3, 1]"), HasSubstr("policy.degrees"));
  EXPECT_THAT(error_with(with_polynomials(), "exploration.noise_variance=[1.0, 2.0]"),
              HasSubstr("exploration.noise_variance"));
  EXPECT_THAT(
      error_with(learnable_policies(), "study.rollouts=3"),
      HasSubstr("must be one of: auto, correction, dmp, ds_gmr, network, rbf, spline, tree"));
}

/// The evaluator of a worker that knows the kind, and one run that it evaluates.
double learn(const Study& study, double& first_reward, std::size_t& num_switches) {
  TaskRegistry tasks;
  add_standard_tasks(tasks);
  const auto source = worker::tasks_of(tasks);
  worker::Evaluator evaluator(*source, with_polynomials());
  const Condition& condition = study.conditions[0];
  const ContentHash task_id = content_hash(condition.task_content);
  const auto accepted = [&](const worker::DefinitionContent& definition) {
    return evaluator.define(definition)->accepted;
  };
  EXPECT_TRUE(accepted({{protocol::DefinitionKind::kTask, task_id}, condition.task_content}));
  explore::Exploration run(condition.exploration, *condition.start, 1, 0);
  while (!run.done()) {
    const explore::Draw draw = *run.ask();
    const std::string policy = to_json(run.policy(draw.layer));
    const ContentHash policy_id = content_hash(policy);
    EXPECT_TRUE(accepted({{protocol::DefinitionKind::kPolicy, policy_id}, policy}));
    protocol::RolloutBatch batch;
    batch.rollouts.emplace_back();
    batch.rollouts[0].task_id = task_id;
    batch.rollouts[0].policy_id = policy_id;
    batch.rollouts[0].theta.assign(draw.theta.begin(), draw.theta.end());
    const auto answer = evaluator.answer(batch);
    const Outcome& outcome = answer.results.at(0).outcome;
    EXPECT_TRUE(outcome.is_ok());
    if (draw.rollout == 0) first_reward = outcome.reward();
    run.tell(draw.rollout, outcome);
  }
  num_switches = run.switches().size();
  return run.best().reward;
}

TEST(PolynomialPolicyTest, LearnsThroughAWorkersEvaluator) {
  const std::string given = "noise_variance = [1.0]\ninitial_noise_factor = 0.3\n";
  for (const std::string& exploration :
       {given, given + "rule = \"cma_es\"\n",
        std::string("rule = \"cma_es\"\ncoordinates = \"sensitivity\"\ninitial_step = 0.5\n")}) {
    std::string text = kStudy;
    text.replace(text.find(given), given.size(), exploration);
    double first = 0;
    std::size_t num_switches = 0;
    const double best = learn(learnable_study(text), first, num_switches);
    EXPECT_GT(best, first + .2) << exploration;
    EXPECT_GT(best, .7) << exploration;
    EXPECT_EQ(num_switches, 1U) << exploration;
  }
}

TEST(PolynomialPolicyTest, APictureShowsItsCurveWithoutGaussians) {
  Eigen::MatrixXd coefficients(1, 2);
  coefficients << 1, 2;
  const auto policy = std::make_shared<PolynomialPolicy>(
      std::vector<int>{1}, PolynomialPolicy::Range{0, 2}, coefficients, 1);
  const auto plots = report::policy_plots("mine", {{.condition = "ladder", .start = policy}});
  ASSERT_EQ(plots.size(), 1U);
  EXPECT_THAT(plots[0].data, HasSubstr("\n0 1\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("\n2 3\n"));
  EXPECT_THAT(plots[0].data, Not(HasSubstr("ellipses")));
}

}  // namespace
}  // namespace treeroll
