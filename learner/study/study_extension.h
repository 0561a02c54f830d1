#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/study/study_file.h"

/// A study that has begun may grow: study.rollouts, study.repetitions and study.stop_after_s, each
/// to as much as before or more. Nothing else of it may change, for what has been learnt would no
/// longer follow from it.
namespace treeroll {

/// Loads the study with the overrides of the command line, "KEY=VALUE" each. They name what may
/// grow, or say what the study has already: a service manager starts it by the same command again.
/// Throws StudyError naming key, values and rule.
LoadedStudy load_extended(const std::filesystem::path& file,
                          const std::vector<std::string>& overrides);

/// Throws StudyError unless `after` is `before` or has grown out of it.
/// @param location  where `after` stands
void check_extends(const LoadedStudy& before, const LoadedStudy& after,
                   const std::string& location);

/// What has grown, for a person: "study.rollouts from 300 to 600"; empty if nothing has.
std::string describe_extension(const Study& before, const Study& after);

}  // namespace treeroll
