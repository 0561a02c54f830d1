#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>

#include "learner/core/rechecks.h"
#include "learner/core/study.h"
#include "learner/journal/journal_fold.h"

namespace treeroll {

/// Which roll-outs of a journal are run again (study.recheck) and whose answer each has, without
/// learning anything. It holds what is open, kRechecksOpenMax at most. A fold of the core alone
/// knows which final evaluations an extension has superseded: what has come of all is its to say.
///
///   for each record: fold.add(record);
class RecheckFold {
 public:
  /// @param study  of the journal; must outlive this
  explicit RecheckFold(const Study& study) : study_(study) {}

  void add(const NumberedRecord& numbered);
  /// The result that a second answer is compared with.
  struct First {
    protocol::WorkerId worker = 0;
    std::int64_t content = 0;              ///< of its question
    std::optional<std::int32_t> run_then;  ///< NumberedRecord's
  };
  /// Nothing where it is compared with none. Before the answer is added. Precondition: it is one.
  std::optional<First> first_of(const NumberedRecord& second) const;
  std::size_t num_open() const { return open_.size(); }

 private:
  struct Open {
    First first;
    std::set<protocol::WorkerId> answered_by;
  };
  void open(const NumberedRecord& numbered, const AcceptedResult& result);
  learner::Opinion opinion_of(const AcceptedResult& result) const;

  const Study& study_;
  std::map<protocol::RolloutKey, Open> open_;
  std::map<protocol::WorkerId, KnownWorker> workers_;
  learner::Rechecks rechecks_;
};

}  // namespace treeroll
