#include "common/task_facts/task_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"

namespace treeroll {
namespace {

using nlohmann::json;

const TaskDescription kReachDescription{
    .input_dim = 1, .output_dim = 2, .reward_max = 1, .time_limit_s = 10, .version = "3"};
const json kSettings{{"gravity", 9.8}, {"steps", 10}, {"plant", {{"m", 1.5}, {"kind", "ode"}}}};

/// What is said where a task makes these of the content that kSettings and kReachDescription are
/// in.
std::string disagreement(const json& settings, const TaskDescription& description) {
  const json content = json::parse(task_content("reach", kSettings, &kReachDescription));
  try {
    check_agreement(content, settings, description);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

constexpr const char* kEnd =
    ": this worker program's task is another one; in a study that you changed yourself, remove "
    "[task.described]";

TEST(TaskAgreementTest, AContentIsAFunctionOfNameSettingsAndDescription) {
  EXPECT_EQ(task_content("reach", {{"b", 1}, {"a", 2}}, nullptr),
            R"({"name":"reach","settings":{"a":2,"b":1}})");
  const json content = json::parse(task_content("reach", kSettings, &kReachDescription));
  EXPECT_EQ(content["settings"], kSettings);
  EXPECT_EQ(content["described"], to_json(kReachDescription));
}

TEST(TaskAgreementTest, TheSameTaskAgrees) {
  EXPECT_EQ(disagreement(kSettings, kReachDescription), "");
  json same = kSettings;
  same["steps"] = 10.0;  // a number is a number
  EXPECT_EQ(disagreement(same, kReachDescription), "");
}

TEST(TaskAgreementTest, AnotherDefaultIsNamedWithBothValues) {
  json other = kSettings;
  other["plant"]["m"] = 1.6;
  EXPECT_EQ(disagreement(other, kReachDescription),
            std::string("task.plant.m = 1.6: was 1.5 when the study began") + kEnd);
  other = kSettings;
  other["gravity"] = "moon";
  EXPECT_EQ(disagreement(other, kReachDescription),
            std::string("task.gravity = \"moon\": was 9.8 when the study began") + kEnd);
}

TEST(TaskAgreementTest, ASettingMoreOrLessIsNamed) {
  json other = kSettings;
  other["wind"] = 0;
  EXPECT_EQ(disagreement(other, kReachDescription),
            std::string("task.wind = 0: did not exist when the study began") + kEnd);
  other = kSettings;
  other.erase("steps");
  EXPECT_EQ(disagreement(other, kReachDescription),
            std::string("task.steps: was 10 when the study began, and does not exist here") + kEnd);
}

TEST(TaskAgreementTest, AnotherDescriptionOrVersionIsNamed) {
  TaskDescription other = kReachDescription;
  other.time_limit_s = 5;
  EXPECT_EQ(disagreement(kSettings, other),
            std::string("task.described.time_limit_s = 5.0: was 10.0 when the study began") + kEnd);
  other = kReachDescription;
  other.version = "4";
  EXPECT_EQ(disagreement(kSettings, other),
            std::string("task.described.version = \"4\": was \"3\" when the study began") + kEnd);
}

/// A study that began before its task named its signals goes on, and journals keep their hashes.
TEST(TaskAgreementTest, NamesOfSignalsAreNoPartOfWhatATaskIs) {
  TaskDescription named = kReachDescription;
  named.signals = {{"t_s"}, {"x_m"}};
  EXPECT_EQ(task_content("reach", kSettings, &named),
            task_content("reach", kSettings, &kReachDescription));
  EXPECT_EQ(disagreement(kSettings, named), "");
  EXPECT_EQ(treeroll::disagreement(kReachDescription, named), std::nullopt);
}

TEST(TaskAgreementTest, WhatNobodyHasResolvedMayComeToAnything) {
  const json content = json::parse(task_content("reach", json::object(), nullptr));
  EXPECT_NO_THROW(check_agreement(content, kSettings, kReachDescription));
}

TEST(TaskAgreementTest, LongValuesAreCut) {
  json other = kSettings;
  other["gravity"] = std::string(10'000, 'x');
  EXPECT_LT(disagreement(other, kReachDescription).size(), 250U);
}

}  // namespace
}  // namespace treeroll
