#include "learner/journal/journal_rechecks.h"

#include <utility>

#include "learner/core/run.h"

namespace treeroll {

void RecheckFold::add(const NumberedRecord& numbered) {
  if (const auto* worker = std::get_if<KnownWorker>(&numbered.record)) {
    workers_[worker->worker_id] = *worker;
  } else if (const auto* first = std::get_if<AcceptedResult>(&numbered.record)) {
    open(numbered, *first);
  } else if (const auto* second = std::get_if<SecondAnswer>(&numbered.record)) {
    const AcceptedResult& result = second->result;
    if (!first_of(numbered) || !open_.at(result.key).answered_by.insert(result.worker_id).second) {
      return;
    }
    if (result.outcome.is_discarded()) {  // of the policy it says nothing
      rechecks_.drop(result.key);
    } else if (rechecks_.take(result.key, opinion_of(result)).wants_another) {
      return;
    }
    open_.erase(result.key);
  }
}

std::optional<RecheckFold::First> RecheckFold::first_of(const NumberedRecord& second) const {
  const AcceptedResult& answer = std::get<SecondAnswer>(second.record).result;
  const auto found = open_.find(answer.key);
  if (found == open_.end()) return std::nullopt;
  const First& first = found->second.first;
  // A content is also of the number of its run: once that is another only the key tells.
  const bool is_numbered_anew = first.run_then != second.run_then;
  return is_numbered_anew || first.content == answer.content ? std::optional(first) : std::nullopt;
}

void RecheckFold::open(const NumberedRecord& numbered, const AcceptedResult& result) {
  const int repetition = result.key.run % study_.repetitions;
  const bool is_run_again = learner::is_rechecked(study_, repetition, result.key.number);
  if (result.outcome.is_discarded() || !is_run_again) return;
  // After an extension another question may stand under the number of one that is open yet.
  if (open_.erase(result.key) > 0) rechecks_.drop(result.key);
  open_[result.key] = {{result.worker_id, result.content, numbered.run_then}, {result.worker_id}};
  if (const auto given_up = rechecks_.open(result.key, opinion_of(result))) open_.erase(*given_up);
}

learner::Opinion RecheckFold::opinion_of(const AcceptedResult& result) const {
  const auto known = workers_.find(result.worker_id);
  return {known == workers_.end() ? KnownWorker{result.worker_id, "", "", 0} : known->second,
          result.outcome};
}

}  // namespace treeroll
