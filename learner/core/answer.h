#pragma once

#include "common/base/outcome.h"

namespace treeroll::learner {

/// What a roll-out has come to, and on what kind of processor.
struct Answer {
  Outcome outcome;
  int numeric_class = 0;  ///< by the learner's count
};

/// Of an answer whose worker was another incarnation's, or of one class too many: it compares with
/// nothing.
inline constexpr int kUnknownClass = -1;

}  // namespace treeroll::learner
