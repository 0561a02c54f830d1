#include "learner/results/study_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include "common/files/whole_file.h"
#include "learner/results/csv_reader.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr int kRunsMax = 100'000;
constexpr int kRolloutsMax = 100'000'000;
/// Applied as results arrive, a run that was stopped lacks at most those that were in flight.
constexpr std::int64_t kGapsMax = 1'000'000;

enum RunColumn {
  kCondition,
  kRepetition,
  kRun,
  kRollouts,
  kBest,
  kFinal,
  kSwitch,
  kFailed,
  kSwitches,
  kStartReward,
  kStartStatus,
  kFinalRewards,
  kFinalLow,
  kFinalHigh,
  kFirstStatus,  ///< counts of each status but ok
  kDiscarded = kFirstStatus + kNumRolloutStatuses - 1,
  kLastFailure
};
constexpr std::size_t kOldRunColumns = kSwitches + 1;
enum RolloutColumn { kRollout = 3, kLayer, kReward, kStatus, kReason };
constexpr std::size_t kOldRolloutColumns = kStatus + 1;

/// What runs.csv says beside a record, to be checked against the roll-outs.
struct Counts {
  std::int64_t rollouts = 0;
  std::int64_t failed = 0;
  std::int64_t switches = 0;
  std::optional<double> best_reward;
  bool has_failures = false;  ///< the columns below are there
  std::array<std::int64_t, kNumRolloutStatuses> by_status{};
  std::string last_failure;
};

constexpr std::array kCountColumns = {"diverged", "task_failed", "crashed", "timed_out",
                                      "given_up"};
static_assert(kCountColumns.size() + 1 == kNumRolloutStatuses);

RolloutStatus read_status(const CsvReader& table, int column, std::string_view word) {
  const std::optional<RolloutStatus> status = rollout_status(word);
  if (!status) {
    table.refuse(column, "must be ok, diverged, failed, crashed, timed_out or discarded");
  }
  return *status;
}

/// "0.5;diverged;0.25".
std::vector<Outcome> read_finals(const CsvReader& table) {
  std::vector<Outcome> finals;
  std::string_view list = table.text(kFinalRewards);
  while (!list.empty()) {
    const std::string_view word = list.substr(0, list.find(';'));
    list.remove_prefix(std::min(list.size(), word.size() + 1));
    if (const auto reward = table.as_reward(word)) {
      finals.push_back(Outcome::ok(*reward));
    } else {
      finals.push_back(Outcome::failed(read_status(table, kFinalRewards, word)));
    }
  }
  return finals;
}

/// The columns that files of an earlier version lack.
void read_worth(const CsvReader& table, RunRecord& run, Counts& count) {
  if (!table.empty(kStartStatus)) {
    const RolloutStatus status = read_status(table, kStartStatus, table.text(kStartStatus));
    run.start = Outcome(table.empty(kStartReward) ? 0 : table.reward(kStartReward), status);
  }
  run.finals = read_finals(table);
  if (!run.finals.empty() && run.final_reward && run.final_reward != mean_reward(run.finals)) {
    table.refuse(kFinalRewards, "must be what final_reward is the mean of");
  }
  count.has_failures = !table.empty(kDiscarded);
  if (!count.has_failures) return;
  for (int i = 1; i < kNumRolloutStatuses; ++i) {
    count.by_status[static_cast<std::size_t>(i)] =
        table.integer(kFirstStatus + i - 1, 0, count.failed);
  }
  run.num_discarded = static_cast<int>(table.integer(kDiscarded, 0, INT32_MAX));
  count.last_failure = table.text(kLastFailure);
}

void read_runs(const fs::path& path, std::vector<RunRecord>& runs, std::vector<Counts>& counts) {
  CsvReader table(path,
                  {"condition",
                   "repetition",
                   "run",
                   "rollouts",
                   "best_reward",
                   "final_reward",
                   "rollouts_before_switch",
                   "failed",
                   "switches",
                   "start_reward",
                   "start_status",
                   "final_rewards",
                   "final_low",
                   "final_high",
                   "diverged",
                   "task_failed",
                   "crashed",
                   "timed_out",
                   "given_up",
                   "discarded",
                   "last_failure"},
                  kOldRunColumns);
  std::set<std::string> conditions;
  while (table.next()) {
    RunRecord run;
    run.condition = table.text(kCondition);
    run.repetition = static_cast<int>(table.integer(kRepetition, 0, kRunsMax));
    run.run = static_cast<int>(table.integer(kRun, 0, kRunsMax));
    if (run.run != static_cast<int>(runs.size())) table.refuse(kRun, "runs must count 0, 1, ...");
    const bool new_condition = runs.empty() || runs.back().condition != run.condition;
    if (new_condition && !conditions.insert(run.condition).second) {
      table.refuse(kCondition, "the runs of a condition must stand together");
    }
    // A policy is read from a file of this name.
    if (run.condition.find_first_of(std::string_view("/\0", 2)) != std::string::npos) {
      table.refuse(kCondition, "must hold no slash, as it names files");
    }
    const int repetition = new_condition ? 0 : runs.back().repetition + 1;
    if (run.repetition != repetition) {
      table.refuse(kRepetition, "repetitions of a condition must count 0, 1, ...");
    }
    Counts count;
    count.rollouts = table.integer(kRollouts, 0, kRolloutsMax);
    count.failed = table.integer(kFailed, 0, count.rollouts);
    count.switches = table.integer(kSwitches, 0, count.rollouts);
    if (!table.empty(kBest)) count.best_reward = table.reward(kBest);
    if (!table.empty(kFinal)) run.final_reward = table.reward(kFinal);
    for (const std::int64_t number : table.integers(kSwitch, 1, kRolloutsMax)) {
      run.switches.push_back(static_cast<int>(number) - 1);
    }
    if (static_cast<std::int64_t>(run.switches.size()) != count.switches) {
      table.refuse(kSwitch,
                   fmt::format("must be as many as there are switches, {}", count.switches));
    }
    read_worth(table, run, count);
    runs.push_back(std::move(run));
    counts.push_back(count);
  }
}

void read_rollouts(const fs::path& path, const std::vector<Counts>& counts,
                   std::vector<RunRecord>& runs) {
  CsvReader table(
      path, {"condition", "repetition", "run", "rollout", "layer", "reward", "status", "reason"},
      kOldRolloutColumns);
  if (runs.empty()) return;
  while (table.next()) {
    const auto number = table.integer(kRun, 0, static_cast<std::int64_t>(runs.size()) - 1);
    RunRecord& run = runs[static_cast<std::size_t>(number)];
    if (table.text(kCondition) != run.condition) {
      table.refuse(kCondition, fmt::format("run {} is of {} in runs.csv", number, run.condition));
    }
    if (table.integer(kRepetition, 0, kRunsMax) != run.repetition) {
      table.refuse(kRepetition,
                   fmt::format("run {} is repetition {} in runs.csv", number, run.repetition));
    }
    const std::int64_t max = std::min<std::int64_t>(
        kRolloutsMax, counts[static_cast<std::size_t>(number)].rollouts + kGapsMax);
    const auto rollout = static_cast<std::size_t>(table.integer(kRollout, 0, max - 1));
    if (rollout < run.rollouts.size()) {
      table.refuse(kRollout, "the roll-outs of a run must stand in order, each once");
    }
    RolloutRecord record;
    record.layer = static_cast<std::int16_t>(
        table.integer(kLayer, 1, std::numeric_limits<std::int16_t>::max()));
    // Roll-outs are drawn in the order of their numbers, and no layer is left without results.
    if (!run.rollouts.empty()) {
      const int before = run.rollouts.back().layer;
      if (record.layer != before && record.layer != before + 1) {
        table.refuse(kLayer, fmt::format("must be {} as before, or the next", before));
      }
    }
    record.reward = table.reward(kReward);
    record.status = read_status(table, kStatus, table.text(kStatus));
    record.reason = file_reason(run.reasons, table.text(kReason));
    run.rollouts.resize(rollout);
    run.rollouts.push_back(record);
    if (run.best_rollout < 0 || record.reward > run.best_reward) {
      run.best_rollout = static_cast<int>(rollout);
      run.best_reward = record.reward;
    }
  }
}

/// runs.csv is written from the roll-outs: another count says that one of the files is cut off or
/// from another study.
void check(const fs::path& directory, const Counts& counts, const RunRecord& run) {
  const auto require = [&](bool holds, const char* column, const std::string& value,
                           const std::string& found) {
    if (holds) return;
    throw std::runtime_error(fmt::format("{}:{}: {} = {}: must be {}, as in rollouts.csv",
                                         (directory / "runs.csv").string(), run.run + 2, column,
                                         value, found));
  };
  require(counts.rollouts == num_applied(run), "rollouts", std::to_string(counts.rollouts),
          std::to_string(num_applied(run)));
  require(counts.failed == num_failed(run), "failed", std::to_string(counts.failed),
          std::to_string(num_failed(run)));
  for (int i = 1; counts.has_failures && i < kNumRolloutStatuses; ++i) {
    const auto status = static_cast<RolloutStatus>(i);
    const std::int64_t count = counts.by_status[static_cast<std::size_t>(i)];
    require(count == num_with(run, status), kCountColumns[static_cast<std::size_t>(i - 1)],
            std::to_string(count), std::to_string(num_with(run, status)));
  }
  if (counts.has_failures) {
    // Of more reasons than a run keeps, which are kept depends on the order of arrival.
    const bool has_all = run.reasons.size() < static_cast<std::size_t>(kReasonsPerRunMax);
    require(!has_all || counts.last_failure == last_failure(run), "last_failure",
            counts.last_failure, last_failure(run));
  }
  const auto first = std::find_if(run.rollouts.begin(), run.rollouts.end(), is_applied);
  const int first_layer = first == run.rollouts.end() ? 1 : first->layer;
  const int layers_left = first == run.rollouts.end() ? 0 : run.rollouts.back().layer - first_layer;
  // The layer that is reached by the last switch may have no results, at the run's end.
  require(counts.switches >= layers_left, "switches", std::to_string(counts.switches),
          fmt::format("at least {}", layers_left));
  // The result after which a layer is left is of that layer.
  for (std::size_t i = 0; i < run.switches.size(); ++i) {
    const auto number = static_cast<std::size_t>(run.switches[i]);
    const int layer = first_layer + static_cast<int>(i);
    require(number < run.rollouts.size() && run.rollouts[number].layer == layer,
            "rollouts_before_switch", std::to_string(rollouts_before(run.switches[i])),
            fmt::format("up to a roll-out of the layer that was left, {}", layer));
  }
  const double best = counts.best_reward.value_or(-1);
  const double found = run.best_rollout >= 0 ? run.best_reward : -1;
  require(best == found, "best_reward", best < 0 ? "" : fmt::format("{}", best),
          found < 0 ? "empty" : fmt::format("{}", found));
}

}  // namespace

StudyResults read_study_results(const fs::path& directory) {
  StudyResults results{.name = {}, .directory = directory, .runs = {}};
  std::vector<Counts> counts;
  read_runs(directory / "runs.csv", results.runs, counts);
  read_rollouts(directory / "rollouts.csv", counts, results.runs);
  for (RunRecord& run : results.runs) {
    check(directory, counts[static_cast<std::size_t>(run.run)], run);
    const fs::path best = directory / best_policy_file(run);
    if (fs::exists(best)) run.best_policy = read_whole_file(best);
    const fs::path final_policy = directory / final_policy_file(run);
    if (fs::exists(final_policy)) run.final_policy = read_whole_file(final_policy);
  }
  return results;
}

}  // namespace treeroll
