#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "learner/core/answer.h"
#include "learner/core/run_record.h"
#include "learner/core/study.h"
#include "learner/explore/exploration.h"

namespace treeroll::learner {

/// One run of a study: its search, the order in which results reach it, and its record.
/// Roll-outs 0 .. N-1 are the budget; number kEvaluation is the final evaluation of the mean
/// policy, asked for once the budget is spent.
class Run {
 public:
  static constexpr int kEvaluation = -1;

  /// Precondition: `study` outlives the run.
  Run(const Study& study, int run);

  /// Draws no more: its time is up. What has been asked for is still accepted, then the mean policy
  /// as it is now is evaluated. Nothing happens to a run that has ended by itself.
  void stop() { exploration_.stop(); }

  /// What may be asked for now and has not been; after construction, each accept() and stop(). The
  /// evaluation comes as a draw without noise, number kEvaluation.
  std::vector<explore::Draw> take_draws();

  /// A result for a roll-out that was asked for and has none yet. In sequence it is held until
  /// all lower numbers are in. @return how many results were applied
  int accept(int number, Outcome outcome, int numeric_class);

  /// The result a roll-out has (held or applied), else nothing.
  std::optional<Answer> answer_of(int number) const;

  bool done() const { return final_.has_value(); }
  int index() const { return index_; }
  int condition() const { return condition_; }
  int repetition() const { return repetition_; }
  const explore::Exploration& exploration() const { return exploration_; }
  int num_failed() const { return num_failed_; }
  double last_reward() const { return records_.empty() ? 0 : last_reward_; }

  /// Best policy so far as JSON; empty if its theta makes none, which can only be while every
  /// roll-out has failed. Precondition: a result has been applied.
  std::string best_policy() const;
  RunRecord record() const;

 private:
  void apply(int number, const Answer& answer);

  const Study* study_;
  int index_;
  int condition_;
  int repetition_;
  explore::Exploration exploration_;
  bool evaluation_wanted_ = false;
  std::map<int, Answer> held_;  // answered before a lower number was
  std::vector<RolloutRecord> records_;
  int num_failed_ = 0;
  double last_reward_ = 0;
  std::optional<Answer> final_;
};

}  // namespace treeroll::learner
