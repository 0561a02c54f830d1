#pragma once

#include <string>
#include <utility>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll::report_test {

/// A run of roll-outs at layer 1 with these rewards; the best is found among them.
inline RunRecord run_with(std::string condition, int repetition, int run,
                          const std::vector<double>& rewards) {
  RunRecord record;
  record.condition = std::move(condition);
  record.repetition = repetition;
  record.run = run;
  for (const double reward : rewards) {
    if (record.best_rollout < 0 || reward > record.best_reward) {
      record.best_rollout = static_cast<int>(record.rollouts.size());
      record.best_reward = reward;
    }
    record.rollouts.push_back({.reward = reward, .layer = 1});
  }
  return record;
}

}  // namespace treeroll::report_test
