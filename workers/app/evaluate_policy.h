#pragma once

#include "workers/app/evaluated_task.h"

namespace treeroll::worker {

/// Evaluates one policy in this process, off the bus: what treeroll-evaluate asks of a worker
/// executable. Reads a request from standard input and prints the answer:
///
///   {"task": {"name": "swing_up", "settings": {}}, "policy": TEXT, "seed": 0, "trace": true}
///   {"description": {...}, "evaluation": {"reward": .98, "status": "ok", "reason": "",
///    "terms": {NAME: number, ...}}, "trace": {"columns": [NAME, ...], "numbers": [row after row],
///    "policy_inputs": [NAME, ...],
///              "policy_outputs": [NAME, ...], "poses": [[[x, y, x, y, ...], ...], ...]}}
///   {"error": {"key": "policy", "value": "", "rule": "..."}}
///
/// TEXT is that of common/policy/policy.h; seed (0) and trace (false) may be left out, and the
/// answer has a trace only if it was asked for. A number that is not finite is null. The process
/// ends by SIGXCPU when the evaluation has taken the task's time limit, rounded up to seconds.
/// @return  exit status: 0, 2 for a bad request or a user's program that cannot be started, 1 if
///          the answer could not be written
int evaluate_policy(const TaskSourceMaker& start);

}  // namespace treeroll::worker
