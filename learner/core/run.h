#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "learner/core/answer.h"
#include "learner/core/run_record.h"
#include "learner/core/study.h"
#include "learner/explore/exploration.h"

namespace treeroll::learner {

/// Seed of the task for one trial of a roll-out, or of an evaluation. Repetitions and conditions
/// share it; a trial that repeats a discarded one has another, or a task whose seed decides that a
/// trial is void would discard it for ever.
/// @param trial  0, then one more for each that was discarded
std::int64_t task_seed(const Study& study, int repetition, int number, int trial);

/// Whether a roll-out, or an evaluation, is of the share that is run again on another worker: by
/// the study's seed alone. Conditions share it.
bool is_rechecked(const Study& study, int repetition, int number);

/// Whether a trial is void since the person who was to begin or to judge it was away, which its
/// reason begins with: "nobody answered". That may be for a night: it counts against no
/// study.discards_max.
bool is_unattended(const Outcome& outcome);

/// One run of a study: its search, the order in which results reach it, and its record.
/// Roll-outs 0 .. N-1 are the budget. Outside of it the start policy is evaluated once, and the
/// final mean policy study.final_evaluations times, once the budget is spent.
class Run {
 public:
  static constexpr int kStart = -2;
  static constexpr int kFinal = -1;  ///< the first evaluation of the final policy
  /// Of evaluation i of the final policy.
  static constexpr int final_number(int i) { return i == 0 ? kFinal : kStart - i; }

  /// Precondition: `study` outlives the run.
  Run(const Study& study, int run);
  /// @param first  explore::first_start() of the run's condition, which its repetitions share
  Run(const Study& study, int run, explore::LayerStart first);

  /// Draws no more: its time is up. What has been asked for is still accepted, then the mean policy
  /// as it is now is evaluated. Nothing happens to a run that has ended by itself.
  void stop() { exploration_.stop(); }

  /// What may be asked for now and has not been; after construction, each accept() and stop().
  /// Evaluations come as draws without noise; what was discarded comes as it was drawn.
  std::vector<explore::Draw> take_draws();

  /// A result for a roll-out that was asked for and has none yet. One that was discarded is wanted
  /// again; once more often than study.discards_max it is a result, and the run draws no more. In
  /// sequence a result is held until all lower numbers are in.
  /// @return how many results were applied
  /// @param on_applied  may be empty; else called with the number of each, once it is
  int accept(int number, const Outcome& outcome, int numeric_class,
             const std::function<void(int)>& on_applied = {});
  /// The same up to the first result that ends a layer. Those behind it wait in their order; before
  /// stop(), make_switch() is called until is_at_switch() is false.
  int accept_to_switch(int number, const Outcome& outcome, int numeric_class,
                       const std::function<void(int)>& on_applied = {});
  bool is_at_switch() const { return exploration_.is_at_switch(); }
  /// One switch, then what waits for it, up to the next one.
  int make_switch(const std::function<void(int)>& on_applied = {});

  /// Of the policy of a roll-out that has been drawn.
  int layer_of(int number) const;

  /// The result a roll-out has (held or applied), else nothing.
  std::optional<Answer> answer_of(int number) const;
  /// Discarded trials of a roll-out that has no result yet.
  int num_discards(int number) const;
  /// Whether such an outcome of it would be a discard too many.
  bool would_give_up(int number, const Outcome& outcome) const;

  bool done() const;
  int index() const { return index_; }
  int condition() const { return condition_; }
  int repetition() const { return repetition_; }
  const explore::Exploration& exploration() const { return exploration_; }
  int num_failed() const { return num_failed_; }
  int num_discarded() const { return num_discarded_; }  ///< trials, of evaluations too
  /// Applied ones, by number; in arrival order there may be gaps (RolloutRecord::layer is 0).
  const std::vector<RolloutRecord>& rollouts() const { return records_; }
  const std::vector<std::string>& reasons() const { return reasons_; }
  double last_reward() const { return records_.empty() ? 0 : last_reward_; }

  /// Best policy so far as JSON; empty if its theta makes none, which can only be while every
  /// roll-out has failed. Precondition: a result has been applied.
  std::string best_policy() const;
  RunRecord record() const&;
  /// The same, without a copy of the roll-outs.
  RunRecord record() &&;

 private:
  RunRecord record_without_rollouts() const;
  void apply(int number, const Answer& answer);
  int apply_waiting(const std::function<void(int)>& on_applied);

  const Study* study_;
  int index_;
  int condition_;
  int repetition_;
  explore::Exploration exploration_;
  explore::Draw start_;
  bool start_wanted_ = false;
  bool finals_wanted_ = false;
  std::map<int, Answer> evaluations_;  // answered, by number
  struct Discards {
    int num_trials = 0;
    int num_unattended = 0;
  };
  std::map<int, Discards> discards_;  // by number, of what has no result
  std::vector<int> wanted_again_;
  std::map<int, Answer> held_;  // answered before a lower number was, or while a switch is due
  std::deque<int> arrived_;     // of these, where results count as they arrive
  std::vector<RolloutRecord> records_;
  std::vector<std::string> reasons_;
  int num_failed_ = 0;
  int num_discarded_ = 0;
  double last_reward_ = 0;
};

}  // namespace treeroll::learner
