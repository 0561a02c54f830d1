#include "learner/study/study_reference.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"
#include "learner/fit/start_policy.h"
#include "learner/study/document_keys.h"
#include "learner/study/study_table.h"
#include "learner/study/task_table.h"

namespace treeroll {
namespace {

/// A demonstration under the names that the examples of inputs and outputs have.
std::string example_file(const std::string& /*name*/) {
  constexpr int kSamples = 50;
  std::string text = "t_s,x_m\n";
  for (int i = 0; i < kSamples; ++i) {
    const double time_s = .04 * i;
    text += fmt::format("{},{}\n", time_s, time_s * (2 - time_s));
  }
  return text;
}

void read_one_axis(SettingsReader& axis) {
  read_axis_name(axis);
  if (axis.has("options")) {
    read_axis_options(axis);
  } else {
    read_axis_key(axis);
    read_axis_values(axis);
  }
}

/// The policy of a study that says nothing.
PolicyPtr default_start(const PolicyRegistry& policies) {
  const nlohmann::json nothing = nlohmann::json::object();
  nlohmann::json resolved;
  SettingsReader reader(nothing, "policy", resolved);
  return policies.read_start(reader, {}).policy;
}

}  // namespace

std::vector<StudyTableReference> study_reference() {
  const PolicyRegistry policies = learnable_policies();
  const PolicyPtr start = default_start(policies);
  std::vector<StudyTableReference> tables;
  tables.push_back({"[study]", list_settings("study", [](SettingsReader& reader) {
                      Study study;
                      read_study_table(reader, study);
                    })});
  tables.push_back({"[policy]", list_settings("policy", [&](SettingsReader& reader) {
                      read_given_policy(reader);
                      read_start_file_name(reader);
                      policies.read_start(reader, {.read_file = example_file});
                    })});
  tables.push_back({"[exploration]", list_settings("exploration", [&](SettingsReader& reader) {
                      explore::read_exploration_settings(reader, *start);
                    })});
  tables.push_back({"[[conditions]] and [[axes]]", list_settings("", [](SettingsReader& reader) {
                      read_extends(reader);
                      if (reader.has("conditions")) read_conditions(reader);
                      if (reader.has("axes")) read_axes(reader);
                    })});
  tables.push_back(
      {"A condition, or an option of an axis",
       list_settings("conditions", [](SettingsReader& reader) { read_condition_name(reader); })});
  tables.push_back({"An axis", list_settings("axes", read_one_axis)});
  tables.push_back(
      {"[task]", list_settings("task", [](SettingsReader& reader) { read_task_name(reader); })});
  return tables;
}

}  // namespace treeroll
