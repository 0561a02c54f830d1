#include "workers/app/evaluator.h"

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/settings_reader.h"
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
  }
  TaskDescription description() const override {
    return {.input_dim = 1, .output_dim = 1, .time_limit_s = 1};
  }
  Outcome evaluate(Controller& controller, std::uint64_t seed) override {
    controller.start();
    const double mean = controller.act(0);
    if (mean == 7) throw std::runtime_error("seven");
    if (mean == 8) throw 8;  // NOLINT(hicpp-exception-baseclass)
    if (mean == 9) return Outcome::ok(std::numeric_limits<double>::quiet_NaN());
    if (mean == 10) return Outcome::ok(static_cast<double>(seed) / 10);
    if (mean == 11) return {.5, RolloutStatus::kDiverged};
    return Outcome::ok(mean);
  }
};

class EvaluatorTest : public testing::Test {
 protected:
  EvaluatorTest() : registry_(make_registry()), evaluator_(registry_) {}

  static TaskRegistry make_registry() {
    TaskRegistry registry;
    add_task<MirrorTask>(registry, "mirror");
    return registry;
  }
  DefinitionReport define_task(const std::string& content) {
    return std::get<DefinitionReport>(
        *evaluator_.handle(protocol::TaskDefinition{0, content_hash("t"), content}));
  }
  DefinitionReport define_policy(const std::string& content) {
    return std::get<DefinitionReport>(
        *evaluator_.handle(protocol::PolicyDefinition{0, content_hash("p"), content}));
  }
  void define() {
    ASSERT_TRUE(define_task(R"({"name":"mirror","settings":{}})").accepted);
    ASSERT_TRUE(define_policy(to_json(small_policy())).accepted);
  }
  protocol::RolloutResult evaluate(std::vector<double> theta, std::int64_t seed = 0) {
    protocol::RolloutBatch batch{0, 42, {}, {}};
    batch.rollouts.resize(1);
    batch.rollouts[0].content = 6;
    batch.rollouts[0].task_id = content_hash("t");
    batch.rollouts[0].policy_id = content_hash("p");
    batch.rollouts[0].task_seed = seed;
    batch.rollouts[0].theta = std::move(theta);
    const auto answer = std::get<protocol::RewardBatch>(*evaluator_.handle(batch));
    EXPECT_EQ(answer.last_batch, 42);
    EXPECT_EQ(answer.results.at(0).content, 6);
    return answer.results.at(0);
  }

  TaskRegistry registry_;
  Evaluator evaluator_;
};

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
  EXPECT_FALSE(evaluator_.handle(protocol::TaskDefinition{0, content_hash("t"), ""}));
  EXPECT_EQ(evaluate({0, .5, 0}).outcome.status(), RolloutStatus::kFailed);
}

}  // namespace
}  // namespace treeroll::worker
