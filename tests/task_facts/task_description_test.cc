#include "common/task_facts/task_description.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace treeroll {
namespace {

using nlohmann::json;

const TaskDescription kDescription{.input_dim = 2,
                                   .output_dim = 3,
                                   .reward_min = .5,
                                   .reward_max = 4,
                                   .time_limit_s = 7,
                                   .deterministic = false};

/// What is said against the description with one member changed.
std::string error_with(const char* key, const json& value) {
  json changed = to_json(kDescription);
  changed[key] = value;
  const Result<TaskDescription> read = task_description_from_json(changed.dump());
  return read ? "" : read.error().message;
}

TEST(TaskDescriptionTest, IsWrittenWithTheNamesOfItsMembers) {
  EXPECT_EQ(to_json(kDescription),
            json::parse(R"({"input_dim": 2, "output_dim": 3, "reward_min": 0.5, "reward_max": 4.0,
                            "time_limit_s": 7.0, "deterministic": false})"));
}

TEST(TaskDescriptionTest, StatesAVersionOnlyIfThereIsOne) {
  TaskDescription versioned = kDescription;
  versioned.version = "2024-05";
  EXPECT_EQ(to_json(versioned)["version"], "2024-05");
  EXPECT_EQ(*task_description_from_json(to_json(versioned).dump()), versioned);
  EXPECT_FALSE(to_json(kDescription).contains("version"));
  EXPECT_NE(error_with("version", std::string(129, 'x')).find("description.version"),
            std::string::npos);
  EXPECT_NE(error_with("version", 2).find("description.version"), std::string::npos);
}

TEST(TaskDescriptionTest, IsReadAsItWasWritten) {
  const Result<TaskDescription> read = task_description_from_json(to_json(kDescription).dump());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, kDescription);
}

TEST(TaskDescriptionTest, SaysThatItMustNotBeStartedTwiceOnlyWhereThatIsSo) {
  EXPECT_FALSE(to_json(kDescription).contains("repeatable"));
  TaskDescription robot = kDescription;
  robot.repeatable = false;
  const Result<TaskDescription> read = task_description_from_json(to_json(robot).dump());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, robot);
}

TEST(TaskDescriptionTest, IsRefusedWithTheMemberThatBreaksItsRule) {
  const std::vector<std::pair<const char*, json>> broken = {
      {"input_dim", 0},     {"input_dim", kTaskDimMax + 1},
      {"output_dim", 0},    {"output_dim", 1.5},
      {"reward_min", -.1},  {"reward_max", .4},
      {"time_limit_s", 0},  {"time_limit_s", 2e6},
      {"deterministic", 1}, {"repeatable", 1},
      {"other", 1}};
  for (const auto& [key, value] : broken) {
    EXPECT_NE(error_with(key, value).find(std::string("description.") + key), std::string::npos)
        << key << " = " << value << ": " << error_with(key, value);
  }
}

TEST(TaskDescriptionTest, NamesItsSignalsBesideWhatItIs) {
  TaskDescription named = kDescription;
  named.signals = {{"angle_rad", "rate_radps"}, {"x_n", "y_n", "z_n"}};
  EXPECT_EQ(to_json(named), to_json(kDescription)) << "names decide nothing";
  const json whole = to_json_with_signals(named);
  EXPECT_EQ(whole["inputs"], json({"angle_rad", "rate_radps"}));
  EXPECT_EQ(*task_description_from_json(whole.dump()), named);
  EXPECT_EQ(to_json_with_signals(kDescription), to_json(kDescription));
  EXPECT_NE(error_with("inputs", {"angle_rad"}).find("inputs: has 1 names, must have 2"),
            std::string::npos)
      << error_with("inputs", {"angle_rad"});
  EXPECT_NE(error_with("inputs", {"angle_rad", "rate_radps"}).find("outputs: has 0 names"),
            std::string::npos);
  EXPECT_NE(error_with("outputs", 3).find("description.outputs"), std::string::npos);
}

TEST(TaskDescriptionTest, IsRefusedWhenAMemberIsMissing) {
  const json whole = to_json(kDescription);
  for (const auto& [key, value] : whole.items()) {
    json without = whole;
    without.erase(key);
    EXPECT_FALSE(task_description_from_json(without.dump())) << key;
  }
  EXPECT_FALSE(task_description_from_json("none"));
}

}  // namespace
}  // namespace treeroll
