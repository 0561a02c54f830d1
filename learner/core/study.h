#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/signal_names.h"
#include "common/base/time.h"
#include "common/policy/policy.h"
#include "learner/explore/exploration.h"

namespace treeroll {

/// One way of learning, compared with the others of its study.
struct Condition {
  std::string name;  ///< unique in the study
  /// JSON {"name": ..., "settings": {...}}, keys sorted; where the task has been asked, beside them
  /// "described": what it said of itself (common/task_facts/task_agreement.h).
  std::string task_content;
  PolicyPtr start;  ///< before any roll-out; not null
  explore::ExplorationSettings exploration;
  /// What the task calls inputs and outputs, else the file of the start policy: the policies that
  /// are learnt carry it. Empty: nobody has named them.
  SignalNames signals = {};
};

/// What is to be learnt, fully resolved: conditions times repetitions. Run number r is repetition
/// r % repetitions of condition r / repetitions.
struct Study {
  std::string name;
  std::uint64_t seed = 0;
  int repetitions = 1;
  bool in_sequence = true;  ///< results are applied by number, not as they arrive
  /// Time of learning after which no run draws any more; of all runs, since they share the workers.
  std::optional<Duration> stop_after;
  /// Of the workers it takes results from: a name, or "any", or "one", that of the first result.
  std::string numeric_class = "any";
  int final_evaluations = 1;  ///< of each run's final mean policy, each with a seed of its own
  /// Share of roll-outs that are run again on another worker, to compare the answers.
  double recheck = 0;
  /// Trials of one roll-out that its task may discard; one more ends the run. What is_unattended()
  /// (run.h) is none of them.
  int discards_max = 10;
  std::vector<Condition> conditions;

  int num_runs() const { return static_cast<int>(conditions.size()) * repetitions; }
};

}  // namespace treeroll
