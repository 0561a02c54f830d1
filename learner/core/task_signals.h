#pragma once

#include "common/base/content_hash.h"
#include "common/base/signal_names.h"

namespace treeroll {

/// What a task calls its inputs and outputs, where only workers know the task: for the journal, so
/// that the policies of every fold carry the same names.
struct TaskSignals {
  ContentHash task_id;  ///< of its content
  SignalNames names;    ///< not empty
  bool operator==(const TaskSignals&) const = default;
};

}  // namespace treeroll
