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

/// Of the roll-outs from `begin` to before `end`, counted from 0, all of which must be there.
std::optional<double> mean_reward(const RunRecord& run, int begin, int end) {
  if (begin < 0 || begin >= end || end > static_cast<int>(run.rollouts.size())) return {};
  double sum = 0;
  for (int i = begin; i < end; ++i) {
    const RolloutRecord& rollout = run.rollouts[static_cast<std::size_t>(i)];
    if (!is_applied(rollout)) return {};
    sum += rollout.reward;
  }
  return sum / (end - begin);
}

std::optional<double> best_reward(const RunRecord& run, int end) {
  if (end > static_cast<int>(run.rollouts.size()) || end == 0) return {};
  double best = 0;
  for (int i = 0; i < end; ++i) {
    best = std::max(best, run.rollouts[static_cast<std::size_t>(i)].reward);
  }
  return best;
}

std::optional<double> difference(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return {};
  return *a - *b;
}

/// Of the means of five roll-outs that are kSteepSpan apart.
std::optional<double> largest_gain(const RunRecord& run, int end) {
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

std::optional<double> before_switch(const RunRecord& run) {
  if (run.switches.empty()) return {};
  const int end = rollouts_before_switch(run);
  return mean_reward(run, end - kNearby, end);
}

std::optional<double> after_switch(const RunRecord& run) {
  if (run.switches.empty()) return {};
  const int begin = rollouts_before_switch(run);
  return mean_reward(run, begin, begin + kNearby);
}

}  // namespace

std::optional<double> measure(const RunRecord& run, const Measure& measure) {
  const int num_rollouts = static_cast<int>(run.rollouts.size());
  const int end = measure.rollout > 0 ? measure.rollout : num_rollouts;
  switch (measure.kind) {
    case MeasureKind::kNear:
      return mean_reward(run, end - kNearby, end);
    case MeasureKind::kMean:
      return mean_reward(run, measure.from - 1, end);
    case MeasureKind::kBest:
      return best_reward(run, end);
    case MeasureKind::kFinal:
      return run.final_reward;
    case MeasureKind::kSwitch:
      if (num_rollouts == 0) return {};
      return run.switches.empty() ? num_rollouts : rollouts_before_switch(run);
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
