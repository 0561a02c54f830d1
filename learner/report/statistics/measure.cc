#include "learner/report/statistics/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "common/base/check.h"
#include "learner/results/run_counts.h"

namespace treeroll::report {
namespace {

constexpr int kNearby = 5;
constexpr int kSteepSpan = 50;

/// What a run that is done has ended with: the reward that was enough, or its last one. Nothing for
/// one that has not ended, or that something else has ended.
std::optional<double> last_reward(const RunRecord& run, const RunEnding& ending) {
  if (static_cast<int>(run.rollouts.size()) >= ending.budget) return {};
  const auto is_enough = [&](const RolloutRecord& rollout) {
    return is_applied(rollout) && rollout.reward >= *ending.stop_at_reward;
  };
  if (ending.stop_at_reward) {
    const auto enough = std::ranges::find_if(run.rollouts, is_enough);
    if (enough != run.rollouts.end()) return enough->reward;
  }
  const bool was_given_up = num_with(run, RolloutStatus::kDiscarded) > 0;
  if (!ending.is_on_convergence || !run.final_reward || was_given_up || run.rollouts.empty()) {
    return {};
  }
  return run.rollouts.back().reward;
}

/// Of the roll-outs from `begin` to before `end`, counted from 0, all of which must be there.
std::optional<double> mean_reward(const MeasuredRun& run, int begin, int end) {
  if (begin < 0 || begin >= end || end > run.num_rollouts()) return {};
  double sum = 0;
  for (int i = begin; i < end; ++i) {
    const std::optional<double> reward = run.reward(i);
    if (!reward) return {};
    sum += *reward;
  }
  return sum / (end - begin);
}

std::optional<double> best_reward(const MeasuredRun& run, int end) {
  if (end > run.num_rollouts() || end == 0) return {};
  double best = 0;
  for (int i = 0; i < end; ++i) best = std::max(best, run.reward(i).value_or(0));
  return best;
}

std::optional<double> difference(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return {};
  return *a - *b;
}

/// Of the means of five roll-outs that are kSteepSpan apart.
std::optional<double> largest_gain(const MeasuredRun& run, int end) {
  std::optional<double> largest;
  for (int last = kNearby + kSteepSpan; last <= end; ++last) {
    const int first = last - kSteepSpan;
    const auto gain = difference(mean_reward(run, last - kNearby, last),
                                 mean_reward(run, first - kNearby, first));
    if (!gain) return {};
    if (!largest || *gain > *largest) largest = gain;
  }
  return largest;
}

std::optional<double> before_switch(const MeasuredRun& run) {
  if (run->switches.empty()) return {};
  const int end = rollouts_before_switch(*run);
  return mean_reward(run, end - kNearby, end);
}

std::optional<double> after_switch(const MeasuredRun& run) {
  if (run->switches.empty()) return {};
  const int begin = rollouts_before_switch(*run);
  return mean_reward(run, begin, begin + kNearby);
}

}  // namespace

MeasuredRun::MeasuredRun(const RunRecord& record, const RunEnding& ending)
    : record_(&record),
      budget_(std::max(ending.budget, static_cast<int>(record.rollouts.size()))),
      last_(last_reward(record, ending)) {}

std::optional<double> MeasuredRun::reward(int rollout) const {
  if (rollout >= num_recorded()) return rollout < num_rollouts() ? last_ : std::nullopt;
  const RolloutRecord& recorded = record_->rollouts[static_cast<std::size_t>(rollout)];
  return is_applied(recorded) ? std::optional(recorded.reward) : std::nullopt;
}

std::optional<double> measure(const MeasuredRun& run, const Measure& measure) {
  const int num_rollouts = run.num_rollouts();
  const int end = measure.rollout > 0 ? measure.rollout : num_rollouts;
  switch (measure.kind) {
    case MeasureKind::kNear:
      return mean_reward(run, end - kNearby, end);
    case MeasureKind::kMean:
      return mean_reward(run, measure.from - 1, end);
    case MeasureKind::kBest:
      return best_reward(run, end);
    case MeasureKind::kFinal:
      return run->final_reward;
    case MeasureKind::kSwitch:
      if (num_rollouts == 0) return {};
      if (!run->switches.empty()) return rollouts_before_switch(*run);
      // One that was stopped from outside might have switched yet.
      return run.has_ended() ? std::optional<double>(run.budget()) : std::nullopt;
    case MeasureKind::kBeforeSwitch:
      return before_switch(run);
    case MeasureKind::kAfterSwitch:
      return after_switch(run);
    case MeasureKind::kDrop:
      return difference(before_switch(run), after_switch(run));
    case MeasureKind::kGain:
      return difference(mean_reward(run, end - kNearby, end), mean_reward(run, 0, kNearby));
    case MeasureKind::kSteepest:
      return largest_gain(run, end);
    case MeasureKind::kLogLikelihood:
      return {};
  }
  CHECK(false, "a MeasureKind outside its enumeration");
}

std::string describe(const Measure& measure) {
  const std::string place =
      measure.rollout > 0 ? fmt::format("roll-out {}", measure.rollout) : "the last roll-out";
  switch (measure.kind) {
    case MeasureKind::kNear:
      return "reward near " + place;
    case MeasureKind::kMean:
      return fmt::format("mean reward from roll-out {} to {}", measure.from, place);
    case MeasureKind::kBest:
      return "best reward up to " + place;
    case MeasureKind::kFinal:
      return "reward of the final mean policy";
    case MeasureKind::kSwitch:
      return "roll-outs before the first switch";
    case MeasureKind::kBeforeSwitch:
      return "reward of the five roll-outs up to the switch";
    case MeasureKind::kAfterSwitch:
      return "reward of the five roll-outs after the switch";
    case MeasureKind::kDrop:
      return "drop in reward at the switch";
    case MeasureKind::kGain:
      return "gain in reward up to " + place;
    case MeasureKind::kSteepest:
      return fmt::format("largest gain in reward within {} roll-outs up to {}", kSteepSpan, place);
    case MeasureKind::kLogLikelihood:
      return "log-likelihood of the demonstration";
  }
  CHECK(false, "a MeasureKind outside its enumeration");
}

}  // namespace treeroll::report
