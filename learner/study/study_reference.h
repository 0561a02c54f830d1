#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/settings/settings_reference.h"

namespace treeroll {

/// A table of a study file and what may stand in it.
struct StudyTableReference {
  std::string_view heading;
  SettingsReference keys;
};

/// Every key of a study but those of its task, which a worker knows: what those who read a study
/// answer to one that asks. Fits policies to find out: takes seconds.
std::vector<StudyTableReference> study_reference();

}  // namespace treeroll
