#include "workers/core/answer_store.h"

#include "common/base/check.h"
#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"

namespace treeroll::worker {
namespace {

/// Past it the smallest id is dropped: such a learner, back after more than this many others, would
/// start at 1 again and be repeated until re-issued.
constexpr std::size_t kForgottenMax = protocol::kForgottenLearnersMax;

}  // namespace

AnswerStore::AnswerStore(std::size_t num_answers_max) : num_answers_max_(num_answers_max) {
  CHECK(num_answers_max_ > 0, "a store without room");
}

void AnswerStore::add(protocol::LearnerId learner, const protocol::RolloutResult& result) {
  const QuestionKey question{learner, result.key, result.content};
  const auto [place, is_new] = answers_.try_emplace(question, Answer{.result = result});
  CHECK(is_new, "a question answered twice");
  append(question, place->second);
  evict();
}

std::optional<std::int64_t> AnswerStore::repeat(protocol::LearnerId learner,
                                                const protocol::RolloutKey& key,
                                                std::int64_t content, std::int32_t attempt) {
  const QuestionKey question{learner, key, content};
  const auto found = answers_.find(question);
  if (found == answers_.end()) return std::nullopt;
  Answer& answer = found->second;
  answer.result.attempt = attempt;
  if (answer.acknowledged) {
    acknowledged_by_age_.erase(answer.age);
    append(question, answer);
  }
  return answer.index;
}

bool AnswerStore::acknowledge(protocol::LearnerId learner, std::int64_t index) {
  const auto row = rows_.find(learner);
  if (row == rows_.end()) return false;
  auto& pending = row->second.pending;
  bool progress = false;
  while (!pending.empty() && pending.begin()->first <= index) {
    Answer& answer = answers_.at(pending.begin()->second);
    answer.acknowledged = true;
    pending_by_age_.erase(answer.age);
    acknowledged_by_age_.emplace(answer.age, pending.begin()->second);
    pending.erase(pending.begin());
    progress = true;
  }
  return progress;
}

std::int64_t AnswerStore::first_index(protocol::LearnerId learner) const {
  const auto row = rows_.find(learner);
  if (row == rows_.end() || row->second.pending.empty()) return last_index(learner) + 1;
  return row->second.pending.begin()->first;
}

std::int64_t AnswerStore::last_index(protocol::LearnerId learner) const {
  if (const auto row = rows_.find(learner); row != rows_.end()) return row->second.last_index;
  const auto forgotten = forgotten_.find(learner);
  return forgotten == forgotten_.end() ? 0 : forgotten->second;
}

std::vector<protocol::RolloutResult> AnswerStore::from(protocol::LearnerId learner,
                                                       std::int64_t index,
                                                       std::size_t bytes_max) const {
  std::vector<protocol::RolloutResult> results;
  const auto row = rows_.find(learner);
  if (row == rows_.end()) return results;
  const auto& pending = row->second.pending;
  std::size_t bytes = 0;
  for (auto place = pending.find(index); place != pending.end(); ++place) {
    const protocol::RolloutResult& result = answers_.at(place->second).result;
    bytes += protocol::rollout_result_bytes(result.outcome.reason().size());
    if (!results.empty() && bytes > bytes_max) break;
    results.push_back(result);
    if (results.size() == protocol::kResultsPerBatchMax) break;
  }
  return results;
}

void AnswerStore::forget(protocol::LearnerId learner) {
  const std::int64_t index = last_index(learner);
  const auto first = answers_.lower_bound(
      QuestionKey{learner, protocol::RolloutKey{INT32_MIN, INT32_MIN}, INT64_MIN});
  auto last = first;
  for (; last != answers_.end() && std::get<0>(last->first) == learner; ++last) {
    const Answer& answer = last->second;
    (answer.acknowledged ? acknowledged_by_age_ : pending_by_age_).erase(answer.age);
  }
  answers_.erase(first, last);
  rows_.erase(learner);
  if (index > 0) forgotten_[learner] = index;
  if (forgotten_.size() > kForgottenMax) forgotten_.erase(forgotten_.begin());
}

void AnswerStore::append(const QuestionKey& question, Answer& answer) {
  const protocol::LearnerId learner = std::get<0>(question);
  const std::int64_t before = last_index(learner);
  Row& row = rows_[learner];
  row.last_index = before + 1;
  forgotten_.erase(learner);
  answer.index = row.last_index;
  answer.age = next_age_++;
  answer.acknowledged = false;
  row.pending.emplace(answer.index, question);
  pending_by_age_.emplace(answer.age, question);
}

void AnswerStore::evict() {
  while (answers_.size() > num_answers_max_) {
    auto& ages = acknowledged_by_age_.empty() ? pending_by_age_ : acknowledged_by_age_;
    const QuestionKey question = ages.begin()->second;
    const Answer& answer = answers_.at(question);
    // The oldest of all is the oldest of its row too, so the row stays without gaps.
    if (!answer.acknowledged) rows_.at(std::get<0>(question)).pending.erase(answer.index);
    ages.erase(ages.begin());
    answers_.erase(question);
  }
}

}  // namespace treeroll::worker
