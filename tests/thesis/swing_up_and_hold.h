#pragma once

#include <string>
#include <vector>

#include "tests/thesis/run_study.h"

namespace treeroll {

/// Of the final policies of a condition on their perturbed plants.
struct Held {
  int plants = 0;
  int held = 0;
};

inline Held count_held(const std::vector<RunRecord>& runs, const std::string& condition) {
  Held count;
  for (const RunRecord& run : of_condition(runs, condition)) {
    for (const Outcome& outcome : run.finals) {
      ++count.plants;
      if (outcome.reward() > .5) ++count.held;
    }
  }
  return count;
}

}  // namespace treeroll
