#include "learner/study/document_keys.h"

#include "common/protocol/limits.h"
#include "common/settings/settings_reader.h"

namespace treeroll {

using nlohmann::json;
using protocol::kConditionsMax;

std::optional<std::string> read_extends(SettingsReader& study) {
  if (!study.has("extends")) return std::nullopt;
  std::string path =
      study.string("extends", {},
                   {.meaning = "Above all tables: the study file to begin with, relative to this "
                               "one's folder. Tables are merged key by key, conditions and axes by "
                               "their names",
                    .example = "\"swing_up.toml\""});
  if (path.empty()) study.refuse("extends", "must be the path of a study file");
  return path;
}

const json& read_conditions(SettingsReader& study) {
  return study.list(
      "conditions", kConditionsMax,
      {.meaning =
           "What is compared: tables, each with a name and with keys of task, policy and "
           "exploration, or study.rollouts and study.in_flight, on top of the study's own. A "
           "study has conditions, or axes, or both",
       .example = R"([{"name": "flat", "policy": {"model": "flat"}}])"});
}

const json& read_axes(SettingsReader& study) {
  return study.list("axes", kConditionsMax,
                    {.meaning = "Grids: each condition is taken with each value of each axis, the "
                                "last axis running fastest; all together make at most 1000 "
                                "conditions",
                     .example = R"([{"key": "exploration.initial_step", "values": [0.1, 1.0]}])"});
}

std::string read_condition_name(SettingsReader& condition) {
  std::string name = condition.string(
      "name", {},
      {.meaning = "Of the condition or the option, part of the names of its runs and files"});
  if (name.empty()) condition.refuse("name", "must not be empty");
  return name;
}

void read_axis_name(SettingsReader& axis) {
  if (!axis.has("name")) return;
  axis.string("name", {}, {.meaning = "For files that extend this one: theirs takes its place"});
}

std::string read_axis_key(SettingsReader& axis) {
  return axis.string("key", {},
                     {.meaning = "The dotted key that takes each of the values",
                      .example = "\"exploration.initial_step\""});
}

const json& read_axis_values(SettingsReader& axis) {
  return axis.list("values", kConditionsMax,
                   {.meaning = "Numbers, words or lists of them; the conditions are named "
                               "NAME.KEY=VALUE",
                    .example = "[0.1, 1.0]"});
}

const json& read_axis_options(SettingsReader& axis) {
  return axis.list(
      "options", kConditionsMax,
      {.meaning = "In place of key and values: tables, each with a name and several keys",
       .example = R"([{"name": "bold", "exploration": {"initial_step": 1.0}}])"});
}

}  // namespace treeroll
