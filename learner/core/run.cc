#include "learner/core/run.h"

#include <stdexcept>
#include <utility>

#include "common/base/check.h"
#include "common/numbers/random_stream.h"

namespace treeroll::learner {
namespace {

explore::LayerStart first_start(const Study& study, int run) {
  const Condition& condition = study.conditions[run / study.repetitions];
  return explore::first_start(condition.exploration, *condition.start);
}

explore::Exploration start(const Study& study, const Condition& condition, int repetition,
                           explore::LayerStart first) {
  return explore::Exploration(condition.exploration, *condition.start, std::move(first), study.seed,
                              static_cast<std::uint32_t>(repetition));
}

/// JSON of a layer's policy with this theta; empty if it makes none.
std::string policy_text(const Policy& policy, const Eigen::VectorXd& theta,
                        const SignalNames& signals) {
  try {
    return to_json(*policy.with(theta), signals);
  } catch (const std::invalid_argument&) {
    return "";
  }
}

}  // namespace

bool is_unattended(const Outcome& outcome) {
  return outcome.is_discarded() && outcome.reason().starts_with("nobody answered");
}

std::int64_t task_seed(const Study& study, int repetition, int number, int trial) {
  RandomStream stream(study.seed, static_cast<std::uint32_t>(repetition),
                      static_cast<std::uint32_t>(number), RandomPurpose::kTaskSeed);
  for (int i = 0; i < trial; ++i) stream.next_bits();
  return static_cast<std::int64_t>(stream.next_bits());
}

bool is_rechecked(const Study& study, int repetition, int number) {
  if (study.recheck <= 0) return false;
  RandomStream stream(study.seed, static_cast<std::uint32_t>(repetition),
                      static_cast<std::uint32_t>(number), RandomPurpose::kRecheck);
  return stream.next_uniform() < study.recheck;
}

Run::Run(const Study& study, int run) : Run(study, run, first_start(study, run)) {}

Run::Run(const Study& study, int run, explore::LayerStart first)
    : study_(&study),
      index_(run),
      condition_(run / study.repetitions),
      repetition_(run % study.repetitions),
      exploration_(start(study, study.conditions[condition_], repetition_, std::move(first))),
      start_{kStart, exploration_.layer(), exploration_.mean()} {
  // All at once, so that a learner's memory does not grow later.
  records_.reserve(study.conditions[condition_].exploration.num_rollouts);
}

std::vector<explore::Draw> Run::take_draws() {
  std::vector<explore::Draw> draws;
  if (!start_wanted_) draws.push_back(start_);
  start_wanted_ = true;
  for (const int number : wanted_again_) {
    if (const explore::Draw* draw = exploration_.find(number)) {
      draws.push_back(*draw);
    } else {
      draws.push_back(number == kStart
                          ? start_
                          : explore::Draw{number, exploration_.layer(), exploration_.mean()});
    }
  }
  wanted_again_.clear();
  while (std::optional<explore::Draw> draw = exploration_.ask()) {
    draws.push_back(std::move(*draw));
  }
  if (exploration_.done() && !finals_wanted_) {
    finals_wanted_ = true;
    for (int i = 0; i < study_->final_evaluations; ++i) {
      draws.push_back({final_number(i), exploration_.layer(), exploration_.mean()});
    }
  }
  return draws;
}

int Run::accept(int number, const Outcome& outcome, int numeric_class,
                const std::function<void(int)>& on_applied) {
  int applied = accept_to_switch(number, outcome, numeric_class, on_applied);
  while (is_at_switch()) applied += make_switch(on_applied);
  return applied;
}

int Run::make_switch(const std::function<void(int)>& on_applied) {
  exploration_.make_switch();
  return apply_waiting(on_applied);
}

int Run::accept_to_switch(int number, const Outcome& outcome, int numeric_class,
                          const std::function<void(int)>& on_applied) {
  const bool is_evaluation = number < 0;
  CHECK(is_evaluation ? start_wanted_ && !evaluations_.contains(number)
                      : exploration_.find(number) && !held_.contains(number),
        "a result nobody asked for");
  if (outcome.is_discarded() && !would_give_up(number, outcome)) {
    Discards& discards = discards_[number];
    ++discards.num_trials;
    if (is_unattended(outcome)) ++discards.num_unattended;
    ++num_discarded_;
    wanted_again_.push_back(number);
    return 0;
  }
  discards_.erase(number);
  const Answer answer{outcome, numeric_class};
  if (is_evaluation) {
    evaluations_.emplace(number, answer);
    return 0;
  }
  held_.emplace(number, answer);
  if (!study_->in_sequence) arrived_.push_back(number);
  return apply_waiting(on_applied);
}

int Run::apply_waiting(const std::function<void(int)>& on_applied) {
  int applied = 0;
  while (!held_.empty() && !is_at_switch()) {
    const int next = study_->in_sequence ? exploration_.num_told() : arrived_.front();
    const auto in_turn = held_.find(next);
    if (in_turn == held_.end()) break;
    const Answer answer = in_turn->second;
    held_.erase(in_turn);
    if (!study_->in_sequence) arrived_.pop_front();
    apply(next, answer);
    if (on_applied) on_applied(next);
    ++applied;
  }
  return applied;
}

void Run::apply(int number, const Answer& answer) {
  if (records_.size() <= static_cast<std::size_t>(number)) {
    records_.resize(number + 1);
  }
  const Outcome& outcome = answer.outcome;
  records_[number] = {outcome.reward(), static_cast<std::int16_t>(exploration_.find(number)->layer),
                      outcome.status(), file_reason(reasons_, outcome.reason()),
                      answer.numeric_class};
  last_reward_ = outcome.reward();
  if (!outcome.is_ok()) ++num_failed_;
  // Given up: nothing is learnt from it or after it.
  if (outcome.is_discarded()) exploration_.stop();
  exploration_.tell_but_switch(number, outcome);
}

int Run::layer_of(int number) const {
  if (number == kStart) return start_.layer;
  const explore::Draw* draw = exploration_.find(number);
  return draw ? draw->layer : exploration_.layer();
}

std::optional<Answer> Run::answer_of(int number) const {
  if (const auto found = evaluations_.find(number); found != evaluations_.end()) {
    return found->second;
  }
  if (const auto held = held_.find(number); held != held_.end()) return held->second;
  if (number < 0 || static_cast<std::size_t>(number) >= records_.size() ||
      records_[number].layer == 0) {
    return std::nullopt;
  }
  const RolloutRecord& record = records_[number];
  return Answer{{record.reward, record.status}, record.numeric_class};
}

int Run::num_discards(int number) const {
  const auto found = discards_.find(number);
  return found == discards_.end() ? 0 : found->second.num_trials;
}

bool Run::would_give_up(int number, const Outcome& outcome) const {
  if (!outcome.is_discarded() || is_unattended(outcome)) return false;
  const auto found = discards_.find(number);
  const Discards before = found == discards_.end() ? Discards() : found->second;
  return before.num_trials - before.num_unattended >= study_->discards_max;
}

bool Run::done() const {
  return finals_wanted_ &&
         evaluations_.size() == 1 + static_cast<std::size_t>(study_->final_evaluations);
}

std::string Run::best_policy() const {
  const explore::Exploration::Best& best = exploration_.best();
  return policy_text(exploration_.policy(best.layer), best.theta,
                     study_->conditions[condition_].signals);
}

RunRecord Run::record() const& {
  RunRecord record = record_without_rollouts();
  record.rollouts = records_;
  return record;
}

RunRecord Run::record() && {
  RunRecord record = record_without_rollouts();
  record.rollouts = std::move(records_);
  return record;
}

RunRecord Run::record_without_rollouts() const {
  RunRecord record;
  record.condition = study_->conditions[condition_].name;
  record.repetition = repetition_;
  record.run = index_;
  record.reasons = reasons_;
  record.num_discarded = num_discarded_;
  const explore::Exploration::Best& best = exploration_.best();
  record.best_rollout = best.rollout;
  if (best.rollout >= 0) {
    record.best_reward = best.reward;
    record.best_policy = best_policy();
    record.final_policy = policy_text(exploration_.policy(exploration_.layer()),
                                      exploration_.mean(), study_->conditions[condition_].signals);
  }
  if (const std::optional<Answer> answer = answer_of(kStart)) record.start = answer->outcome;
  for (int i = 0; i < study_->final_evaluations; ++i) {
    const std::optional<Answer> answer = answer_of(final_number(i));
    if (answer) record.finals.push_back(answer->outcome);
  }
  // Those that stopped early may have some of them, which say less than was asked for. The start
  // need not be in: version 0.1.0 did not evaluate it.
  const bool has_all = record.finals.size() == static_cast<std::size_t>(study_->final_evaluations);
  if (finals_wanted_ && has_all) record.final_reward = mean_reward(record.finals);
  record.switches = exploration_.switches();
  return record;
}

}  // namespace treeroll::learner
