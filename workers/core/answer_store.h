#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"
#include "workers/core/answer_index.h"

namespace treeroll::worker {

/// Answers a worker has given, so that a question asked again is not computed again, and the
/// numbered row of those each learner has not acknowledged. Bounded: the oldest acknowledged
/// answers go first, then the oldest of all.
class AnswerStore {
 public:
  explicit AnswerStore(std::size_t num_answers_max);

  /// Files a new answer under the learner's next result index.
  /// Precondition: the store has no answer to this question.
  void add(protocol::LearnerId learner, const protocol::RolloutResult& result);

  /// Answers a question once more, under `attempt`: under its old index while that is not
  /// acknowledged, else under a new one. Returns the index; nothing if there is no such answer.
  std::optional<std::int64_t> repeat(protocol::LearnerId learner, const protocol::RolloutKey& key,
                                     std::int64_t content, std::int32_t attempt);

  /// All results up to and including `index` are settled. Returns whether any was not until now. An
  /// index that was never given acknowledges nothing beyond the last given one.
  bool acknowledge(protocol::LearnerId learner, std::int64_t index);

  /// Index of the oldest result that is not acknowledged; of the next one if all are.
  std::int64_t first_index(protocol::LearnerId learner) const;
  /// Index of the newest result; 0 before the first.
  std::int64_t last_index(protocol::LearnerId learner) const;
  /// Consecutive results from this index on that take at most `bytes_max` on the wire: one at
  /// least, if there is one, and no more than a batch may hold.
  /// Precondition: index >= first_index(learner).
  std::vector<protocol::RolloutResult> from(protocol::LearnerId learner, std::int64_t index,
                                            std::size_t bytes_max) const;
  bool all_acknowledged() const;

  /// Drops the learner's answers. Its index goes on where it was, should it come back.
  void forget(protocol::LearnerId learner);

  std::size_t size() const { return num_answers_; }

 private:
  struct Answer {
    protocol::RolloutResult result;
    std::int64_t age = 0;
    bool is_here = true;  ///< not under a newer index since
  };
  /// A learner's answers by index. Those that are not acknowledged stand last, without gaps.
  struct Row {
    std::int64_t last_index = 0;
    std::int64_t acknowledged = 0;  ///< all up to this index
    std::deque<Answer> answers;     ///< the last one has last_index, the first one is here
    AnswerIndex indices;

    std::int64_t first_kept() const { return last_index - std::ssize(answers) + 1; }
    std::int64_t first_pending() const { return std::max(acknowledged + 1, first_kept()); }
    const Answer& at(std::int64_t index) const {
      return answers.at(static_cast<std::size_t>(index - first_kept()));
    }
  };

  bool append(Row& row, protocol::RolloutResult result);
  static void drop_leading_gaps(Row& row);
  void drop_oldest(Row& row);
  void evict();

  std::size_t num_answers_max_;
  std::size_t num_answers_ = 0;
  std::int64_t next_age_ = 0;
  std::map<protocol::LearnerId, Row> rows_;
  std::map<protocol::LearnerId, std::int64_t> forgotten_;  // last index
};

}  // namespace treeroll::worker
