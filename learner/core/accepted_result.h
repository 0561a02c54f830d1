#pragma once

#include <cstdint>
#include <optional>

#include "common/base/outcome.h"
#include "common/protocol/messages.h"

namespace treeroll {

/// A result the learner has accepted: with the study, all that its state depends on.
struct AcceptedResult {
  protocol::RolloutKey key;
  std::int64_t content = 0;  ///< of the question: a fold recomputes and compares it
  Outcome outcome;
  protocol::WorkerId worker_id = 0;
  /// Wall time of the evaluation, for people: nothing follows from it. Journals of earlier versions
  /// do not tell it.
  std::optional<std::int64_t> duration_ns = std::nullopt;
  bool operator==(const AcceptedResult&) const = default;
};

/// What one more worker has answered to the question of an accepted result (study.recheck). Nothing
/// is learnt from it: it tells whether the two can both be right.
struct SecondAnswer {
  AcceptedResult result;
  bool operator==(const SecondAnswer&) const = default;
};

}  // namespace treeroll
