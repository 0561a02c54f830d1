#pragma once

#include <string>
#include <vector>

namespace treeroll::doctor {

enum class Level {
  kOk,
  kNotice,   ///< a study runs; what it costs is said
  kTrouble,  ///< a study stands still, loses results or mixes what it should not
};

/// One thing that was looked at: a line for a person.
struct Finding {
  Level level = Level::kOk;
  std::string subject;    ///< a word: "route", "worker"
  std::string text;       ///< what was found
  std::string cure = {};  ///< what to do; empty where nothing is to be done
};

using Findings = std::vector<Finding>;

}  // namespace treeroll::doctor
