#pragma once

#include <map>
#include <string>

namespace treeroll::report {

/// What the rewards of a condition's start policy and of its best policy are made of, as the task
/// says; empty where it says nothing, or nobody could be asked.
struct PolicyTerms {
  std::string condition;
  std::map<std::string, double> start;
  std::map<std::string, double> best;
};

}  // namespace treeroll::report
