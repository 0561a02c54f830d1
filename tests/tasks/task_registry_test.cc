#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/mixture/gmr.h"
#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "common/settings/settings_reference.h"
#include "tests/tasks/rollouts.h"
#include "workers/tasks/task.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// The example of task.h.
class ReachTask : public Task {
 public:
  explicit ReachTask(SettingsReader& settings) : goal_m_(settings.number("goal_m", kPositive, 1)) {}
  TaskDescription description() const override {
    return {.input_dim = 1, .output_dim = 1, .reward_max = 1, .time_limit_s = 1};
  }
  Outcome evaluate(Controller& controller, std::uint64_t) override {
    controller.start();
    const double miss_m = controller.act(2.) - goal_m_;
    return Outcome::ok(elementary::exp(-miss_m * miss_m));
  }

 private:
  double goal_m_;
};

TaskRegistry registry() {
  TaskRegistry tasks;
  add_standard_tasks(tasks);
  add_task<ReachTask>(tasks, "reach");
  return tasks;
}

std::string refusal_of(const std::string& name, const char* settings) {
  json resolved;
  try {
    (void)registry().make(name, json::parse(settings), resolved);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(TaskRegistryTest, MakesATaskOfOnesOwn) {
  json resolved;
  const auto task = registry().make("reach", json::parse(R"({"goal_m": 3})"), resolved);
  const Gmm there(
      1, {{.prior = 1, .mean = Eigen::Vector2d(0, 3), .covariance = Eigen::Matrix2d::Identity()}});
  EXPECT_EQ(evaluate(*task, there, 0).reward(), 1);
  EXPECT_EQ(resolved, json::parse(R"({"goal_m": 3.0})"));
}

TEST(TaskRegistryTest, EverySettingHasAMeaningAndNoneIsHidden) {
  TaskRegistry tasks;
  add_standard_tasks(tasks);
  for (const std::string& name : tasks.names()) {
    const SettingsReference settings = tasks.settings(name);
    EXPECT_TRUE(settings.refused.empty()) << name << ": " << settings.refused.front();
    EXPECT_FALSE(settings.keys.empty()) << name;
    for (const ListedKey& key : settings.keys) EXPECT_NE(key.note.meaning, "") << key.note.key;
  }
  EXPECT_EQ(registry().settings("reach").keys.size(), 1u);
}

TEST(TaskRegistryTest, NamesTheTasksItKnows) {
  EXPECT_EQ(
      refusal_of("swingup", "{}"),
      "task.name = \"swingup\": must be a task this worker knows: hold, reach, spiral, swing_up, "
      "synthetic, track, trajectory");
}

TEST(TaskRegistryTest, RefusesSettingsATaskDoesNotAskFor) {
  EXPECT_NE(refusal_of("reach", R"({"goal": 3})").find("task.goal = 3: unknown key"),
            std::string::npos);
  EXPECT_NE(refusal_of("swing_up", R"({"step": 1})").find("task.step = 1: unknown key"),
            std::string::npos);
  EXPECT_NE(refusal_of("swing_up", "[1]").find("must be a table"), std::string::npos);
}

TEST(TaskRegistryTest, ResolvedSettingsMakeTheSameTaskAgain) {
  for (const char* name : {"swing_up", "synthetic", "hold", "spiral", "track", "reach"}) {
    json once, twice;
    (void)registry().make(name, json::object(), once);
    (void)registry().make(name, once, twice);
    EXPECT_EQ(once, twice) << name;
    EXPECT_GT(once.size(), 0U) << name;
  }
}

}  // namespace
}  // namespace treeroll
