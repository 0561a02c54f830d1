#pragma once

#include <vector>

#include "learner/core/learner_events.h"

namespace treeroll::learner {

/// The parts of a learner's effects, each in its order.
inline std::vector<AcceptedResult> results_in(const Effects& effects) {
  std::vector<AcceptedResult> results;
  for (const Effect& effect : effects) {
    if (const auto* append = std::get_if<AppendResult>(&effect)) results.push_back(append->result);
  }
  return results;
}

inline std::vector<protocol::Message> messages_in(const Effects& effects) {
  std::vector<protocol::Message> messages;
  for (const Effect& effect : effects) {
    if (const auto* send = std::get_if<SendMessage>(&effect)) messages.push_back(send->message);
  }
  return messages;
}

}  // namespace treeroll::learner
