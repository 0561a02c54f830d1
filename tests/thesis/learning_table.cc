#include "tests/thesis/learning_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace treeroll {
namespace {

LearningRow& row_of(std::vector<LearningRow>& rows, const std::string& condition) {
  for (LearningRow& row : rows) {
    if (row.condition == condition) return row;
  }
  rows.emplace_back().condition = condition;
  return rows.back();
}

double near_end(const RunRecord& run) {
  const std::size_t count = std::min<std::size_t>(5, run.rollouts.size());
  double sum = 0;
  for (std::size_t i = run.rollouts.size() - count; i < run.rollouts.size(); ++i) {
    sum += run.rollouts[i].reward;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

std::string shown(int rollouts) { return rollouts < 0 ? "-" : std::to_string(rollouts); }

}  // namespace

double LearningRow::share_at(int budget) const {
  const auto within = std::upper_bound(rollouts.begin(), rollouts.end(), budget) - rollouts.begin();
  return static_cast<double>(within) / runs;
}

int LearningRow::rollouts_for(double share) const {
  const auto needed = static_cast<std::size_t>(std::ceil(share * runs - 1e-9));
  return needed == 0 || needed > rollouts.size() ? -1 : rollouts[needed - 1];
}

std::vector<LearningRow> learning_rows(const std::vector<RunRecord>& runs, double target) {
  std::vector<LearningRow> rows;
  for (const RunRecord& run : runs) {
    LearningRow& row = row_of(rows, run.condition);
    ++row.runs;
    if (run.start) row.start = run.start->reward();
    row.mean_best += run.best_reward;
    row.mean_near_end += near_end(run);
    const auto hit =
        std::find_if(run.rollouts.begin(), run.rollouts.end(),
                     [&](const RolloutRecord& rollout) { return rollout.reward >= target; });
    if (hit != run.rollouts.end()) {
      row.rollouts.push_back(static_cast<int>(hit - run.rollouts.begin()) + 1);
    }
  }
  for (LearningRow& row : rows) {
    row.mean_best /= row.runs;
    row.mean_near_end /= row.runs;
    std::sort(row.rollouts.begin(), row.rollouts.end());
  }
  return rows;
}

std::string learning_table(const std::vector<LearningRow>& rows, const std::vector<int>& budgets) {
  std::string text = "| condition | runs | start |";
  std::string rule = "|---|---|---|";
  for (const int budget : budgets) {
    text += fmt::format(" by {} |", budget);
    rule += "---|";
  }
  text += " median | p90 | max | mean best | near end |\n" + rule + "---|---|---|---|---|\n";
  for (const LearningRow& row : rows) {
    text += fmt::format("| {} | {} | {:.3f} |", row.condition, row.runs, row.start);
    for (const int budget : budgets) text += fmt::format(" {:.3f} |", row.share_at(budget));
    text += fmt::format(" {} | {} | {} | {:.4f} | {:.4f} |\n", shown(row.rollouts_for(.5)),
                        shown(row.rollouts_for(.9)), shown(row.rollouts_for(1)), row.mean_best,
                        row.mean_near_end);
  }
  return text;
}

}  // namespace treeroll
