#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "learner/core/rechecks.h"
#include "learner/core/study.h"
#include "learner/journal/journal_fold.h"

namespace treeroll {

/// Follows the roll-outs of a journal that were run again (study.recheck), as the workforce did,
/// without learning anything. It holds what is open, kRechecksOpenMax at most, and counts of what
/// is settled.
///
///   for each record: fold.add(record);
class RecheckFold {
 public:
  /// @param study  of the journal; must outlive this
  explicit RecheckFold(const Study& study) : study_(study) {}

  void add(const NumberedRecord& numbered);
  /// Who has given the result that this answer is compared with; nothing where it is compared with
  /// none. Before the answer is added.
  std::optional<protocol::WorkerId> first_of(const SecondAnswer& answer) const;
  const RecheckRecord& record() const { return rechecks_.record(); }
  std::size_t num_open() const { return open_.size(); }

 private:
  struct Open {
    std::int64_t content = 0;
    protocol::WorkerId first = 0;
    std::set<protocol::WorkerId> answered_by;
  };
  void open(const AcceptedResult& result);
  learner::Opinion opinion_of(const AcceptedResult& result) const;

  const Study& study_;
  std::map<protocol::RolloutKey, Open> open_;
  std::map<protocol::WorkerId, KnownWorker> workers_;
  learner::Rechecks rechecks_;
};

/// What a journal holds of them. Throws as fold_journal() does.
RecheckRecord rechecks_of(const std::filesystem::path& journal, const StudyInJournal& in_journal,
                          const Study& study);

}  // namespace treeroll
