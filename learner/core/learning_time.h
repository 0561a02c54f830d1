#pragma once

#include "common/base/time.h"

namespace treeroll {

/// How long learners have been at work on a study, earlier incarnations included: time in which one
/// ran, whether it had workers or not. Where a study is learnt for a time, what a run comes to
/// depends on when that has passed; so this goes into the journal like a result, in its place among
/// them, and nowhere else is a clock taken into account.
struct LearningTime {
  Duration elapsed{};
  bool operator==(const LearningTime&) const = default;
};

}  // namespace treeroll
