#include "learner/core/run.h"

#include <stdexcept>

#include "common/base/check.h"

namespace treeroll::learner {
namespace {

explore::Exploration start(const Study& study, const Condition& condition, int repetition) {
  return explore::Exploration(condition.exploration, *condition.start, study.seed,
                              static_cast<std::uint32_t>(repetition));
}

}  // namespace

Run::Run(const Study& study, int run)
    : study_(&study),
      index_(run),
      condition_(run / study.repetitions),
      repetition_(run % study.repetitions),
      exploration_(start(study, study.conditions[condition_], repetition_)) {
  // All at once, so that a learner's memory does not grow later.
  records_.reserve(study.conditions[condition_].exploration.num_rollouts);
}

std::vector<explore::Draw> Run::take_draws() {
  std::vector<explore::Draw> draws;
  while (std::optional<explore::Draw> draw = exploration_.ask()) {
    draws.push_back(std::move(*draw));
  }
  if (exploration_.done() && !evaluation_wanted_) {
    evaluation_wanted_ = true;
    draws.push_back({kEvaluation, exploration_.layer(), exploration_.mean()});
  }
  return draws;
}

int Run::accept(int number, Outcome outcome, int numeric_class) {
  const Answer answer{outcome, numeric_class};
  if (number == kEvaluation) {
    CHECK(evaluation_wanted_ && !final_, "an evaluation nobody asked for");
    final_ = answer;
    return 0;
  }
  CHECK(exploration_.find(number) && !held_.contains(number), "a result nobody asked for");
  if (!study_->in_sequence) {
    apply(number, answer);
    return 1;
  }
  held_.emplace(number, answer);
  int applied = 0;
  while (!held_.empty() && held_.begin()->first == exploration_.num_told()) {
    const auto [lowest, in_turn] = *held_.begin();
    held_.erase(held_.begin());
    apply(lowest, in_turn);
    ++applied;
  }
  return applied;
}

void Run::apply(int number, const Answer& answer) {
  if (records_.size() <= static_cast<std::size_t>(number)) {
    records_.resize(number + 1);
  }
  records_[number] = {answer.outcome.reward(),
                      static_cast<std::int16_t>(exploration_.find(number)->layer),
                      answer.outcome.status(), answer.numeric_class};
  last_reward_ = answer.outcome.reward();
  if (!answer.outcome.is_ok()) ++num_failed_;
  exploration_.tell(number, answer.outcome.reward(), answer.outcome.status());
}

std::optional<Answer> Run::answer_of(int number) const {
  if (number == kEvaluation) return final_;
  if (const auto held = held_.find(number); held != held_.end()) return held->second;
  if (number < 0 || static_cast<std::size_t>(number) >= records_.size() ||
      records_[number].layer == 0) {
    return std::nullopt;
  }
  const RolloutRecord& record = records_[number];
  return Answer{{record.reward, record.status}, record.numeric_class};
}

std::string Run::best_policy() const {
  const explore::Exploration::Best& best = exploration_.best();
  try {
    return to_json(*exploration_.policy(best.layer).with(best.theta));
  } catch (const std::invalid_argument&) {
    return "";
  }
}

RunRecord Run::record() const {
  RunRecord record;
  record.condition = study_->conditions[condition_].name;
  record.repetition = repetition_;
  record.run = index_;
  record.rollouts = records_;
  const explore::Exploration::Best& best = exploration_.best();
  record.best_rollout = best.rollout;
  if (best.rollout >= 0) {
    record.best_reward = best.reward;
    record.best_policy = best_policy();
  }
  if (final_) record.final_reward = final_->outcome.reward();
  record.switches = exploration_.switches();
  return record;
}

}  // namespace treeroll::learner
