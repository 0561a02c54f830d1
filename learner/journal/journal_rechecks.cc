#include "learner/journal/journal_rechecks.h"

#include <map>
#include <set>
#include <utility>

#include "learner/core/rechecks.h"

namespace treeroll {
namespace {

/// More repetitions number runs anew, but a question's content tells it apart.
using Question = std::pair<protocol::RolloutKey, std::int64_t>;

Question question_of(const AcceptedResult& result) { return {result.key, result.content}; }

/// As the workforce does it, of the questions that have a second answer.
class RecheckFold {
 public:
  explicit RecheckFold(const std::set<Question>& asked_again) : asked_again_(asked_again) {}

  void add(const JournalRecord& record) {
    if (const auto* worker = std::get_if<KnownWorker>(&record)) {
      workers_[worker->worker_id] = *worker;
    } else if (const auto* first = std::get_if<AcceptedResult>(&record)) {
      if (!asked_again_.contains(question_of(*first))) return;
      // After an extension another question may stand under the number of one that is open yet.
      if (rechecks_.is_open(first->key)) rechecks_.drop(first->key);
      open_[first->key] = {first->content, {first->worker_id}};
      rechecks_.open(first->key, opinion_of(*first));
    } else if (const auto* second = std::get_if<SecondAnswer>(&record)) {
      const AcceptedResult& result = second->result;
      if (!rechecks_.is_open(result.key)) return;
      Open& open = open_.at(result.key);
      if (open.content != result.content || !open.answered_by.insert(result.worker_id).second)
        return;
      result.outcome.is_discarded() ? rechecks_.drop(result.key)
                                    : void(rechecks_.take(result.key, opinion_of(result)));
    }
  }
  RecheckRecord take() && { return rechecks_.record(); }

 private:
  learner::Opinion opinion_of(const AcceptedResult& result) const {
    const auto known = workers_.find(result.worker_id);
    return {known == workers_.end() ? KnownWorker{result.worker_id, "", "", 0} : known->second,
            result.outcome};
  }

  struct Open {
    std::int64_t content = 0;
    std::set<protocol::WorkerId> answered_by;
  };
  const std::set<Question>& asked_again_;
  std::map<protocol::RolloutKey, Open> open_;  // and some that are open no more
  std::map<protocol::WorkerId, KnownWorker> workers_;
  learner::Rechecks rechecks_;
};

}  // namespace

Result<RecheckRecord> rechecks_of(const std::filesystem::path& journal) {
  std::set<Question> asked_again;
  const Result<JournalTail> first = read_journal(journal, [&](const JournalRecord& record) {
    if (const auto* second = std::get_if<SecondAnswer>(&record)) {
      asked_again.insert(question_of(second->result));
    }
  });
  if (!first) return first.error();
  if (asked_again.empty()) return RecheckRecord{};
  RecheckFold fold(asked_again);
  const Result<JournalTail> second =
      read_journal(journal, [&](const JournalRecord& record) { fold.add(record); });
  if (!second) return second.error();
  return std::move(fold).take();
}

}  // namespace treeroll
