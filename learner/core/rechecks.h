#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "common/base/outcome.h"
#include "learner/core/recheck_record.h"

namespace treeroll::learner {

/// What one worker has answered to a question.
struct Opinion {
  KnownWorker worker;
  Outcome outcome;
};

/// Workers of one class give the same bits. Who has not said its class is of none.
bool is_one_class(const Opinion& a, const Opinion& b);
/// Whether both can be right: of one numeric class to the bit, of two within
/// kRewardShareBetweenClasses.
bool agree(const Opinion& a, const Opinion& b);

/// Roll-outs that are run again on another worker. Two workers of one class that disagree cannot
/// both be right: further ones are asked, until two agree against one. That one is outvoted.
/// Workers of one host or key have one vote. A function of the answers in their order, so a journal
/// gives the same.
///
///   open(key, first answer) --take(key, another)--> agree: settled
///                                                   differ: one more is asked, take() again
class Rechecks {
 public:
  /// The first answer to a roll-out that is to be run again.
  /// @return  one that is given up for it, where too many wait: the oldest
  std::optional<protocol::RolloutKey> open(protocol::RolloutKey key, Opinion first);
  /// Another answer. What has come of it:
  struct News {
    std::vector<std::pair<Opinion, Opinion>> disagreements;  ///< with earlier ones; earlier first
    std::vector<KnownWorker> outvoted;
    std::vector<KnownWorker> others;  ///< who have answered it, and are not outvoted
    bool wants_another = false;       ///< else the roll-out is settled, and open no more
  };
  /// Precondition: is_open(key), and this worker has not answered it.
  News take(protocol::RolloutKey key, Opinion another);
  /// Nobody can say more of it. Precondition: is_open(key).
  void drop(protocol::RolloutKey key);

  bool is_open(protocol::RolloutKey key) const { return open_.contains(key); }
  /// In the order in which they were opened.
  const std::deque<protocol::RolloutKey>& waiting() const { return row_; }
  bool is_outvoted(protocol::WorkerId worker) const;
  const RecheckRecord& record() const { return record_; }

 private:
  void compare(const Opinion& a, const Opinion& b, News& news);
  RecheckedWorker* tally_of(const KnownWorker& worker);

  std::map<protocol::RolloutKey, std::vector<Opinion>> open_;
  std::deque<protocol::RolloutKey> row_;
  RecheckRecord record_;
};

}  // namespace treeroll::learner
