#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "common/task_facts/task_description.h"

namespace treeroll::learner {

class Run;

struct LearnerSettings {
  protocol::LearnerId learner_id = 0;
  std::string host = {};  ///< for watchers
  std::int32_t pid = 0;
  std::size_t batch_bytes_max = 0;  ///< of one roll-out batch that holds more than one roll-out
  std::size_t word_bytes = 0;       ///< what a batch takes more for each worker that it names
  /// Only who has a key is heard: what workers say of themselves is believed at once.
  bool is_authenticated = false;
  /// Descriptions known beforehand, by task content; the others are asked of the workers.
  std::map<std::string, TaskDescription> known_tasks;
  std::string numeric_class = "any";  ///< Study::numeric_class, set by the core
  /// Accepted results that may wait for JournalSynced; past it nothing is accepted or given out.
  std::int64_t unsynced_results_max = protocol::kUnsyncedResultsMax;
  /// May be empty; else called with a run and the number of each of its results, once it is applied
  /// and before the next one is; before the switch where it ends a layer.
  std::function<void(const Run&, int)> on_applied = {};
};

}  // namespace treeroll::learner
