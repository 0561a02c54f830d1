#include "workers/core/answer_store.h"

#include <utility>

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
  const std::int64_t before = last_index(learner);
  const auto [place, is_new_row] = rows_.try_emplace(learner);
  Row& row = place->second;
  if (is_new_row) {
    row.last_index = row.acknowledged = before;
    forgotten_.erase(learner);
  }
  const bool is_new = append(row, result);
  CHECK(is_new, "a question answered twice");
  ++num_answers_;
  evict();
}

/// @return whether the question has not been answered before
bool AnswerStore::append(Row& row, protocol::RolloutResult result) {
  const bool is_new = row.indices.set({result.key, result.content}, ++row.last_index);
  row.answers.push_back({.result = std::move(result), .age = next_age_++});
  return is_new;
}

std::optional<std::int64_t> AnswerStore::repeat(protocol::LearnerId learner,
                                                const protocol::RolloutKey& key,
                                                std::int64_t content, std::int32_t attempt) {
  const auto found = rows_.find(learner);
  if (found == rows_.end()) return std::nullopt;
  Row& row = found->second;
  const std::optional<std::int64_t> index = row.indices.find({key, content});
  if (!index) return std::nullopt;
  Answer& answer = row.answers.at(static_cast<std::size_t>(*index - row.first_kept()));
  answer.result.attempt = attempt;
  if (*index > row.acknowledged) return index;
  answer.is_here = false;
  append(row, answer.result);
  drop_leading_gaps(row);
  // Behind one that is not asked again each repetition leaves a gap.
  while (row.answers.size() > num_answers_max_) drop_oldest(row);
  return row.last_index;
}

bool AnswerStore::acknowledge(protocol::LearnerId learner, std::int64_t index) {
  const auto found = rows_.find(learner);
  if (found == rows_.end()) return false;
  Row& row = found->second;
  const std::int64_t first = row.first_pending();
  row.acknowledged = std::max(row.acknowledged, std::min(index, row.last_index));
  return row.first_pending() > first;
}

std::int64_t AnswerStore::first_index(protocol::LearnerId learner) const {
  const auto row = rows_.find(learner);
  return row == rows_.end() ? last_index(learner) + 1 : row->second.first_pending();
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
  const auto found = rows_.find(learner);
  if (found == rows_.end()) return results;
  const Row& row = found->second;
  std::size_t bytes = 0;
  for (; index <= row.last_index; ++index) {
    const protocol::RolloutResult& result = row.at(index).result;
    bytes += protocol::rollout_result_bytes(result.outcome.reason().size());
    if (!results.empty() && bytes > bytes_max) break;
    results.push_back(result);
    if (results.size() == protocol::kResultsPerBatchMax) break;
  }
  return results;
}

bool AnswerStore::all_acknowledged() const {
  return std::ranges::all_of(rows_, [](const auto& entry) {
    return entry.second.first_pending() > entry.second.last_index;
  });
}

void AnswerStore::forget(protocol::LearnerId learner) {
  const std::int64_t index = last_index(learner);
  if (const auto row = rows_.find(learner); row != rows_.end()) {
    num_answers_ -= row->second.indices.size();
    rows_.erase(row);
  }
  if (index > 0) forgotten_[learner] = index;
  if (forgotten_.size() > kForgottenMax) forgotten_.erase(forgotten_.begin());
}

void AnswerStore::drop_leading_gaps(Row& row) {
  while (!row.answers.empty() && !row.answers.front().is_here) row.answers.pop_front();
}

void AnswerStore::evict() {
  while (num_answers_ > num_answers_max_) {
    Row* victim = nullptr;
    const auto rank = [](const Row& row) {
      return std::pair(row.first_kept() > row.acknowledged, row.answers.front().age);
    };
    for (auto& [learner, row] : rows_) {
      if (row.answers.empty()) continue;
      if (victim == nullptr || rank(row) < rank(*victim)) victim = &row;
    }
    drop_oldest(*victim);
  }
}

void AnswerStore::drop_oldest(Row& row) {
  const protocol::RolloutResult& result = row.answers.front().result;
  row.indices.erase({result.key, result.content});
  row.answers.pop_front();
  drop_leading_gaps(row);
  --num_answers_;
}

}  // namespace treeroll::worker
