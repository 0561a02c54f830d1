#include "workers/app/evaluator.h"

#include <gmock/gmock.h>

#include <cfenv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "common/settings/settings_reader.h"
#include "tests/worker_app/learner_stand_in.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using protocol::DefinitionReport;
using ::testing::HasSubstr;

/// Its reward is theta's second number, the mean of the output; some have a meaning.
class MirrorTask : public Task {
 public:
  explicit MirrorTask(SettingsReader& settings) {
    if (settings.boolean("throw", false)) throw std::runtime_error("no \xff luck");
    description_.input_dim = static_cast<int>(settings.integer("input_dim", -10, 10000, 1));
    description_.reward_min = settings.number("reward_min", {}, 0);
    description_.reward_max = settings.number("reward_max", {}, 1);
    description_.time_limit_s = settings.number("time_limit_s", {}, 1);
    if (settings.boolean("nan", false)) description_.time_limit_s = std::nan("");
    if (settings.boolean("round_down", false)) std::fesetround(FE_DOWNWARD);
    side_by_side_ = settings.boolean("side_by_side", false);
    lose_one_ = settings.boolean("lose_one", false);
  }
  TaskDescription description() const override { return description_; }
  Outcome evaluate(Controller& controller, std::uint64_t seed) override {
    controller.start();
    const double mean = controller.act(0);
    if (mean == 7) throw std::runtime_error("seven");
    if (mean == 8) throw 8;  // NOLINT(hicpp-exception-baseclass)
    if (mean == 9) return Outcome::ok(std::numeric_limits<double>::quiet_NaN());
    if (mean == 10) return Outcome::ok(static_cast<double>(seed) / 10);
    if (mean == 11) return {.5, RolloutStatus::kDiverged};
    if (mean == 12) return Outcome::ok(has_standard_modes() ? 1 : 0);
    if (mean == 13 || mean == 14) set_other_modes();
    if (mean == 15) return Outcome::ok(num_together_ / 10.);
    if (mean == 14) throw std::runtime_error("fourteen");
    return Outcome::ok(mean == 13 ? 0 : mean);
  }
  bool side_by_side() const override { return side_by_side_; }
  std::vector<Outcome> evaluate_all(std::span<const Evaluation> evaluations) override {
    num_together_ = static_cast<int>(evaluations.size());
    std::vector<Outcome> outcomes;
    try {
      outcomes = Task::evaluate_all(evaluations);
    } catch (...) {
      num_together_ = 1;
      throw;
    }
    num_together_ = 1;
    if (lose_one_) outcomes.pop_back();
    return outcomes;
  }

 private:
  static bool has_standard_modes() {
    const volatile double smallest = std::numeric_limits<double>::min();
    return std::fegetround() == FE_TONEAREST && smallest / 4 > 0;
  }
  static void set_other_modes() {
    std::fesetround(FE_UPWARD);
#if defined(__x86_64__)
    _mm_setcsr(_mm_getcsr() | 0x8040U);  // denormals are 0, as result and as operand
#endif
  }

  TaskDescription description_{.input_dim = 1, .output_dim = 1};
  bool side_by_side_ = false;
  bool lose_one_ = false;
  int num_together_ = 1;
};

class EvaluatorTest : public testing::Test {
 protected:
  EvaluatorTest() : registry_(make_registry()), tasks_(tasks_of(registry_)), evaluator_(*tasks_) {}

  static TaskRegistry make_registry() {
    TaskRegistry registry;
    add_task<MirrorTask>(registry, "mirror");
    return registry;
  }
  DefinitionReport define_task(const std::string& content) {
    return *evaluator_.define({{protocol::DefinitionKind::kTask, content_hash("t")}, content});
  }
  DefinitionReport define_policy(const std::string& content) {
    return *evaluator_.define({{protocol::DefinitionKind::kPolicy, content_hash("p")}, content});
  }
  void define() {
    ASSERT_TRUE(define_task(R"({"name":"mirror","settings":{}})").accepted);
    ASSERT_TRUE(define_policy(to_json(small_policy())).accepted);
  }
  /// Outcomes of roll-outs in one packet, by theta's second number.
  std::vector<Outcome> evaluate_together(const std::vector<double>& means) {
    protocol::RolloutBatch batch{0, 42, {}, {}};
    for (const double mean : means) {
      batch.rollouts.push_back({.key = {.run = 0, .number = static_cast<int>(mean * 100)},
                                .task_id = content_hash("t"),
                                .policy_id = content_hash("p"),
                                .theta = {0, mean, 0}});
    }
    const auto answer = evaluator_.answer(batch);
    EXPECT_EQ(answer.last_batch, 42);
    std::vector<Outcome> outcomes;
    for (std::size_t i = 0; i < means.size(); ++i) {
      EXPECT_EQ(answer.results.at(i).key, batch.rollouts[i].key);
      outcomes.push_back(answer.results.at(i).outcome);
    }
    EXPECT_EQ(answer.results.size(), means.size());
    return outcomes;
  }
  protocol::RolloutResult evaluate(std::vector<double> theta, std::int64_t seed = 0) {
    protocol::RolloutBatch batch{0, 42, {}, {}};
    batch.rollouts.resize(1);
    batch.rollouts[0].content = 6;
    batch.rollouts[0].task_id = content_hash("t");
    batch.rollouts[0].policy_id = content_hash("p");
    batch.rollouts[0].task_seed = seed;
    batch.rollouts[0].theta = std::move(theta);
    const auto answer = evaluator_.answer(batch);
    EXPECT_EQ(answer.last_batch, 42);
    EXPECT_EQ(answer.results.at(0).content, 6);
    return answer.results.at(0);
  }

  TaskRegistry registry_;
  std::unique_ptr<TaskSource> tasks_;
  Evaluator evaluator_;
};

TEST_F(EvaluatorTest, FloatingPointModesOfOneRolloutDoNotReachTheNext) {
  define();
  EXPECT_EQ(evaluate({0, 12, 0}).outcome.reward(), 1);
  for (const double sets_modes : {13., 14.}) {
    evaluate({0, sets_modes, 0});
    EXPECT_EQ(std::fegetround(), FE_TONEAREST);
    EXPECT_EQ(evaluate({0, 12, 0}).outcome.reward(), 1)
        << "after the task that answers " << sets_modes;
  }
  ASSERT_TRUE(define_task(R"({"name":"mirror","settings":{"round_down":true}})").accepted);
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
  EXPECT_EQ(evaluate({0, 12, 0}).outcome.reward(), 1);
}

/// 15 answers with how many are evaluated beside it.
TEST_F(EvaluatorTest, OfOnePacketAreEvaluatedTogetherIfTheTaskCan) {
  define();
  EXPECT_EQ(evaluate_together({15, 15, .5}),
            (std::vector{Outcome::ok(.1), Outcome::ok(.1), Outcome::ok(.5)}));
  EXPECT_EQ(evaluate_together({13, 12})[1].reward(), 1) << "one's modes have reached the next";
  ASSERT_TRUE(define_task(R"({"name":"mirror","settings":{"side_by_side":true}})").accepted);
  EXPECT_EQ(evaluate_together({15, 15, .5}),
            (std::vector{Outcome::ok(.3), Outcome::ok(.3), Outcome::ok(.5)}));
  EXPECT_EQ(evaluate_together({15}), (std::vector{Outcome::ok(.1)}));
  const auto checked = evaluate_together({9, .5, 3, 11});
  EXPECT_THAT(checked[0].reason(), HasSubstr("outside its range 0 .. 1"));
  EXPECT_EQ(checked[1], Outcome::ok(.5));
  EXPECT_THAT(checked[2].reason(), HasSubstr("the task's reward 3 is outside"));
  EXPECT_EQ(checked[3].status(), RolloutStatus::kDiverged);
}

TEST_F(EvaluatorTest, OneThatThrowsAmongSeveralHasItsReasonAndTheOthersTheirRewards) {
  ASSERT_TRUE(define_policy(to_json(small_policy())).accepted);
  for (const char* settings : {R"("side_by_side":true)", R"("side_by_side":false)",
                               R"("side_by_side":true,"lose_one":true)"}) {
    ASSERT_TRUE(
        define_task(std::string(R"({"name":"mirror","settings":{)") + settings + "}}").accepted);
    const auto outcomes = evaluate_together({.25, 7, 8, 15});
    EXPECT_EQ(outcomes[0], Outcome::ok(.25));
    EXPECT_EQ(outcomes[1], Outcome::failed(RolloutStatus::kFailed, "seven"));
    EXPECT_THAT(outcomes[2].reason(), HasSubstr("no std::exception"));
    EXPECT_EQ(outcomes[3], Outcome::ok(.1)) << "evaluated alone";
  }
}

TEST_F(EvaluatorTest, ADescriptionThatContradictsItselfIsRefusedWithItsNumbers) {
  const auto refusal_of = [this](const std::string& settings) {
    const DefinitionReport report =
        define_task(R"({"name":"mirror","settings":{)" + settings + "}}");
    EXPECT_FALSE(report.accepted) << settings;
    return report.text;
  };
  EXPECT_THAT(
      refusal_of(R"("reward_min": -1)"),
      HasSubstr("task = \"mirror\": describes rewards from -1 to 1: must be a finite range"));
  EXPECT_THAT(refusal_of(R"("reward_min": 2)"), HasSubstr("rewards from 2 to 1"));
  EXPECT_THAT(refusal_of(R"("time_limit_s": 0)"), HasSubstr("a time limit of 0 s: must be above"));
  EXPECT_THAT(refusal_of(R"("time_limit_s": 2e6)"), HasSubstr("a time limit of 2000000 s"));
  EXPECT_THAT(refusal_of(R"("nan": true)"), HasSubstr("a time limit of nan s"));
  EXPECT_THAT(refusal_of(R"("input_dim": 0)"), HasSubstr("0 inputs and 1 outputs: must be from 1"));
  EXPECT_THAT(refusal_of(R"("input_dim": 1025)"), HasSubstr("1025 inputs"));
}

TEST_F(EvaluatorTest, DescribesWhatItCanBuildAndSaysWhyItCannot) {
  EXPECT_EQ(json::parse(define_task(R"({"name":"mirror","settings":{}})").text)["input_dim"], 1);
  const json facts = json::parse(define_policy(to_json(small_policy())).text);
  EXPECT_EQ(facts, (json{{"input_dim", 1}, {"output_dim", 1}, {"theta_dim", 3}}));

  const DefinitionReport unknown = define_task(R"({"name":"other","settings":{}})");
  EXPECT_FALSE(unknown.accepted);
  EXPECT_THAT(unknown.text, HasSubstr("mirror"));
  const DefinitionReport thrown = define_task(R"({"name":"mirror","settings":{"throw":true}})");
  EXPECT_FALSE(thrown.accepted);
  EXPECT_THAT(thrown.text, HasSubstr("no \xef\xbf\xbd luck")) << "what is not UTF-8 is replaced";
  EXPECT_FALSE(define_policy("{}").accepted);
}

TEST_F(EvaluatorTest, GivesRewardsAndSeeds) {
  define();
  EXPECT_EQ(evaluate({0, .5, 0}).outcome.reward(), .5);
  EXPECT_EQ(evaluate({0, 10, 0}, 3).outcome.reward(), .3);
  EXPECT_GT(evaluate({0, .5, 0}).duration_ns, 0);
}

TEST_F(EvaluatorTest, TurnsWhatGoesWrongIntoAStatusWithRewardZero) {
  define();
  for (const double bad : {7., 8., 9., 1.5, -.5}) {
    EXPECT_EQ(evaluate({0, bad, 0}).outcome.status(), RolloutStatus::kFailed) << bad;
    EXPECT_EQ(evaluate({0, bad, 0}).outcome.reward(), 0) << bad;
  }
  EXPECT_EQ(evaluate({0, 11, 0}).outcome.status(), RolloutStatus::kDiverged);
  EXPECT_EQ(evaluate({0, 11, 0}).outcome.reward(), 0);
  EXPECT_EQ(evaluate({.5, 0}).outcome.status(), RolloutStatus::kFailed) << "theta of another size";
  EXPECT_EQ(evaluate({0, .5, 0}).outcome.status(), RolloutStatus::kOk) << "and goes on";
}

TEST_F(EvaluatorTest, ForgetsADefinitionWithoutContent) {
  define();
  EXPECT_FALSE(evaluator_.define({{protocol::DefinitionKind::kTask, content_hash("t")}, ""}));
  EXPECT_EQ(evaluate({0, .5, 0}).outcome.status(), RolloutStatus::kFailed);
}

}  // namespace
}  // namespace treeroll::worker
