#include "learner/results/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "common/base/csv_field.h"
#include "common/files/atomic_file.h"
#include "learner/results/run_counts.h"
#include "learner/results/statistics.h"

namespace treeroll {
namespace {

/// By run number, which is condition * repetitions + repetition.
std::vector<const RunRecord*> sorted(const std::vector<RunRecord>& runs) {
  std::vector<const RunRecord*> by_number;
  by_number.reserve(runs.size());
  for (const RunRecord& run : runs) by_number.push_back(&run);
  std::stable_sort(by_number.begin(), by_number.end(),
                   [](const RunRecord* a, const RunRecord* b) { return a->run < b->run; });
  return by_number;
}

/// What the columns say that stand after `switches`.
void append_worth(const RunRecord& run, std::string& row) {
  const auto out = std::back_inserter(row);
  row += ',';
  if (run.start && !run.start->is_discarded()) fmt::format_to(out, "{}", run.start->reward());
  fmt::format_to(out, ",{},", run.start ? name(run.start->status()) : "");
  for (std::size_t i = 0; i < run.finals.size(); ++i) {
    const Outcome& outcome = run.finals[i];
    if (i > 0) row += ';';
    if (outcome.is_ok()) {
      fmt::format_to(out, "{}", outcome.reward());
    } else {
      row += name(outcome.status());
    }
  }
  row += ',';
  const std::optional<Interval> interval = mean_interval_95(rewards_of(run.finals));
  if (interval) fmt::format_to(out, "{},{}", interval->low, interval->high);
  if (!interval) row += ',';
  for (int i = 1; i < kNumRolloutStatuses; ++i) {
    fmt::format_to(out, ",{}", num_with(run, static_cast<RolloutStatus>(i)));
  }
  fmt::format_to(out, ",{},{}", run.num_discarded, csv_field(last_failure(run)));
}

}  // namespace

void write_rollouts_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs) {
  AtomicFile file(path);
  file.append("condition,repetition,run,rollout,layer,reward,status,reason\n");
  for (const RunRecord* run : sorted(runs)) {
    const std::string prefix =
        fmt::format("{},{},{}", csv_field(run->condition), run->repetition, run->run);
    for (std::size_t number = 0; number < run->rollouts.size(); ++number) {
      const RolloutRecord& rollout = run->rollouts[number];
      if (!is_applied(rollout)) continue;
      file.append(fmt::format("{},{},{},{},{},{}\n", prefix, number, rollout.layer, rollout.reward,
                              name(rollout.status), csv_field(reason_of(*run, rollout))));
    }
  }
  file.commit();
}

void write_runs_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs) {
  AtomicFile file(path);
  file.append(
      "condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,"
      "switches,start_reward,start_status,final_rewards,final_low,final_high,diverged,task_failed,"
      "crashed,timed_out,given_up,discarded,last_failure\n");
  for (const RunRecord* run : sorted(runs)) {
    std::string row = fmt::format("{},{},{},{},", csv_field(run->condition), run->repetition,
                                  run->run, num_applied(*run));
    const auto out = std::back_inserter(row);
    if (run->best_rollout >= 0) fmt::format_to(out, "{}", run->best_reward);
    row += ',';
    if (run->final_reward) fmt::format_to(out, "{}", *run->final_reward);
    row += ',';
    for (std::size_t i = 0; i < run->switches.size(); ++i) {
      fmt::format_to(out, "{}{}", i == 0 ? "" : ";", rollouts_before(run->switches[i]));
    }
    fmt::format_to(out, ",{},{}", num_failed(*run), run->switches.size());
    append_worth(*run, row);
    file.append(row + '\n');
  }
  file.commit();
}

}  // namespace treeroll
