#pragma once

#include <optional>
#include <string>

#include "common/policy/policy.h"
#include "workers/core/worker_events.h"

/// What an evaluator says of a definition it has built, as the text of its DefinitionReport. Of a
/// task it is the description.
namespace treeroll::worker {

std::string facts_text(const Policy& policy);

/// The daemon's side. A user's code runs in the evaluator, so nothing is taken for granted: empty
/// if a number is missing or out of its range.
std::optional<DefinitionFacts> read_facts(DefinitionKind kind, const std::string& text);

}  // namespace treeroll::worker
