#pragma once

#include <string>
#include <vector>

#include "common/task_facts/task_description.h"

namespace treeroll {

/// A setting of a task as a new study shows it.
struct NewTaskSetting {
  std::string key;    ///< below [task], may be dotted
  std::string value;  ///< as TOML, or in words where it is not set
  bool is_set = false;
  std::string meaning;
};

/// What a new study is about.
struct NewStudy {
  std::string name;
  std::string task;
  std::string options;  ///< of the learner, that name the program which knows the task: " --x y"
  std::vector<NewTaskSetting> settings;
  TaskDescription description;
  /// [policy] and [exploration] as the task suggests them; empty: from nothing, by the task's
  /// numbers of inputs and outputs.
  std::string start;
  double input_max = 1;  ///< of a task of one input, such as a time: where it ends
};

/// A short study file (TOML) with comments, to begin with: one condition that learns as it stands.
std::string new_study_text(const NewStudy& study);

}  // namespace treeroll
