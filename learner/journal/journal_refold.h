#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "learner/core/learner_core.h"
#include "learner/journal/journal_fold.h"
#include "learner/journal/journal_rechecks.h"

namespace treeroll {

/// Folds a journal without the results of some workers. What was drawn after one of these may
/// follow from it: such a result answers a question that is not asked any more, and is left out
/// too. Where one more worker has answered the same (study.recheck), its answer takes the place.
/// What remains is a journal as a learner leaves it that was stopped. Of the learning time
/// (study.stop_after_s) only what came before the first result that is lost.
///
///   for each record: refold.read_ahead(record);
///   for each record: write(refold.next(record, now));
class Refold {
 public:
  /// @param core  fresh, and started: it outlives this
  Refold(learner::LearnerCore& core, std::set<protocol::WorkerId> left_out)
      : core_(core), left_out_(std::move(left_out)), rechecks_(core.study()) {}

  void read_ahead(const NumberedRecord& numbered);
  /// What stands in place of this record, with the numbers that runs had then.
  std::vector<JournalRecord> next(const NumberedRecord& numbered, TimePoint now);

  struct Counts {
    std::int64_t num_left_out = 0;   ///< results of those workers
    std::int64_t num_replaced = 0;   ///< of these: another worker's answer took their place
    std::int64_t num_following = 0;  ///< results of others that followed from those left out
    std::int64_t num_kept = 0;
  };
  const Counts& counts() const { return counts_; }
  /// Answers that have been read ahead and are to take a place.
  std::size_t num_held() const { return second_.size(); }
  /// Runs that have lost a result, by number.
  const std::set<std::int32_t>& changed_runs() const { return changed_runs_; }

 private:
  using Question = std::pair<protocol::RolloutKey, std::int64_t>;  // with its content

  bool takes(const NumberedRecord& numbered) const;
  void add(const NumberedRecord& numbered, TimePoint now, std::vector<JournalRecord>& records);
  void add_worker(protocol::WorkerId id, TimePoint now, std::vector<JournalRecord>& records);

  learner::LearnerCore& core_;
  std::set<protocol::WorkerId> left_out_;
  std::map<protocol::WorkerId, KnownWorker> workers_;
  RecheckFold rechecks_;                       // of what is read ahead
  std::map<Question, AcceptedResult> second_;  // that are to take the place of one left out
  std::map<protocol::WorkerId, KnownWorker> written_;
  Counts counts_;
  std::set<std::int32_t> changed_runs_;
};

}  // namespace treeroll
