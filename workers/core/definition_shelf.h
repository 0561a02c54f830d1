#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"
#include "workers/core/definition_cache.h"
#include "workers/core/piece_table.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// The tasks and policies a worker knows, which of them are still to be checked, and what learners
/// are to be told of them.
class DefinitionShelf {
 public:
  /// The settings must outlive the shelf.
  explicit DefinitionShelf(const WorkerSettings& settings);

  /// Null if absent. Valid until the next receive().
  const Definition* find(const DefinitionName& name) const;
  /// Marks it as used now, if it is here.
  void touch(const DefinitionName& name);
  /// A roll-out of this task has ended.
  void on_evaluated(const DefinitionName& task, Duration duration);
  /// Of a learner's task or policy. It is taken with its last piece unless it is not what its id
  /// names or there is no room. The learner is told of it once it is checked, and again when the
  /// first piece of one comes that is known.
  /// @param held  its roll-outs' definitions are not evicted for the new one
  void receive(const Turn& turn, const protocol::DefinitionPiece& piece, const RolloutQueue& held);
  /// The content, of any kind, that this piece is the last one of.
  std::optional<std::string> assemble(const Turn& turn, const protocol::DefinitionPiece& piece,
                                      const RolloutQueue& held);
  /// Pieces of a learner's definition that have not come; none if not one has.
  std::vector<std::int32_t> missing_pieces(protocol::LearnerId learner,
                                           const DefinitionName& name) const {
    return pieces_.missing({learner, name});
  }

  /// The next one to check; it stays until one of the three below says what has come of that.
  /// @param among  null: all
  std::optional<DefinitionName> take_unchecked(const std::set<DefinitionName>* among = nullptr);
  bool has_unchecked() const { return !to_check_.empty(); }
  void on_checked(const Turn& turn, const DefinitionLoaded& result);
  /// The evaluator ended by the definition's fault: it is checked again, in the end refused.
  void on_strike(const Turn& turn, const DefinitionName& name, bool timed_out);
  /// The evaluator ended by no fault of the definition: it is checked first of all.
  void on_accident(const DefinitionName& name);
  /// What was refused may be taken now, once it is sent again.
  void forget_refused();
  /// From now on nothing is checked or taken any more.
  void close();

  /// Whether any definition was accepted or refused since the last call: roll-outs may wait for it.
  bool take_settled() { return std::exchange(settled_, false); }
  /// To be told in this turn. One report for each learner and definition, however often it asked;
  /// a refusal stands. Whom there is no room for asks again.
  void report(protocol::LearnerId learner, const ContentHash& id, bool accepted,
              const std::string& text);
  void send_reports(const Turn& turn);

  /// Grows with each eviction.
  std::int64_t num_evicted() const { return tasks_.num_evicted() + policies_.num_evicted(); }
  /// Definitions that were not what their ids name, and pieces that fit none.
  std::int64_t num_rejected() const { return num_rejected_; }

 private:
  DefinitionCache& cache(DefinitionKind kind);
  Definition* take(const DefinitionName& name, std::string content, const RolloutQueue& held);
  void check_first(const DefinitionName& name, Definition& definition);
  void refuse(const Turn& turn, const DefinitionName& name, Definition& definition,
              std::string reason);
  void settle(const DefinitionName& name, Definition& definition);
  void forget_stale_checks();

  const WorkerSettings& settings_;
  PieceTable pieces_;
  DefinitionCache tasks_;
  DefinitionCache policies_;
  std::deque<DefinitionName> to_check_;
  std::map<std::pair<protocol::LearnerId, ContentHash>, protocol::DefinitionReport> reports_;
  std::int64_t num_rejected_ = 0;
  bool settled_ = false;
  bool closed_ = false;
};

}  // namespace treeroll::worker
