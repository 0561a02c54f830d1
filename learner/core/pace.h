#pragma once

#include <cstdint>
#include <optional>

#include "common/base/time.h"

namespace treeroll::learner {

/// How fast roll-outs come. It says nothing before it knows: answers come in bursts, as many at a
/// time as there are evaluators, and a roll-out may take a millisecond or an hour.
class Pace {
 public:
  /// @param num_done        so far, never fewer than before
  /// @param num_evaluators  that work at it
  void note(TimePoint now, std::int64_t num_done, int num_evaluators);

  /// Roll-outs a second, running mean; nothing until each evaluator may have answered once.
  std::optional<double> per_s() const { return per_s_; }

 private:
  struct Mark {
    TimePoint time;
    std::int64_t num_done = 0;
  };
  std::optional<Mark> since_;
  std::optional<double> per_s_;
};

}  // namespace treeroll::learner
