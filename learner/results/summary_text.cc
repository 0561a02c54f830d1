#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "common/base/shown_reward.h"
#include "learner/results/recheck_text.h"
#include "learner/results/summary.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kNumColumns = 13;
using Row = std::array<std::string, kNumColumns>;

std::string shown(const std::optional<double>& reward) {
  return reward ? shown_reward(*reward) : "-";
}

Row to_row(const ConditionSummary& c) {
  return {c.condition,
          std::to_string(c.num_runs),
          shown(c.mean_start_reward),
          shown(c.mean_best_reward),
          shown_interval(c.interval_95),
          shown(c.median_best_reward),
          shown(c.best_reward),
          shown(c.mean_final_reward),
          shown_interval(c.final_interval_95),
          std::to_string(c.num_rollouts),
          std::to_string(c.num_failed),
          fmt::format("{} in {}/{}", c.num_switches, c.num_runs_switched, c.num_runs),
          c.median_first_switch ? fmt::format("{:.1f}", *c.median_first_switch) : "-"};
}

template <class T>
json or_null(const std::optional<T>& figure) {
  return figure ? json(*figure) : json();
}

json or_null(const std::optional<Interval>& interval) {
  return interval ? json::array({interval->low, interval->high}) : json();
}

json or_null(const std::optional<ConditionSummary::Recommendation>& chosen) {
  if (!chosen) return {};
  return {{"file", chosen->file},
          {"final", chosen->is_final},
          {"repetition", chosen->repetition},
          {"reward", chosen->reward},
          {"interval_95", or_null(chosen->interval_95)},
          {"evaluations", chosen->num_evaluations}};
}

json by_status(const ConditionSummary& c) {
  json counts = json::object();
  for (std::size_t i = 1; i < c.by_status.size(); ++i) {
    counts[std::string(name_of_failure(static_cast<RolloutStatus>(i)))] = c.by_status[i];
  }
  return counts;
}

json to_json_value(const ConditionSummary& c) {
  return {{"condition", c.condition},
          {"runs", c.num_runs},
          {"mean_best_reward", or_null(c.mean_best_reward)},
          {"interval_95", or_null(c.interval_95)},
          {"median_best_reward", or_null(c.median_best_reward)},
          {"best_reward", or_null(c.best_reward)},
          {"mean_final_reward", or_null(c.mean_final_reward)},
          {"final_interval_95", or_null(c.final_interval_95)},
          {"mean_start_reward", or_null(c.mean_start_reward)},
          {"runs_not_beating_start", c.num_not_beating_start},
          {"deterministic", c.is_deterministic},
          {"recommended", or_null(c.recommended)},
          {"rollouts", c.num_rollouts},
          {"failed", c.num_failed},
          {"failed_by_status", by_status(c)},
          {"last_failure", c.last_failure},
          {"discarded", c.num_discarded},
          {"switches", c.num_switches},
          {"runs_switched", c.num_runs_switched},
          {"median_first_switch", or_null(c.median_first_switch)}};
}

json to_json_value(const LedgerCounters& l) {
  return {{"issued", l.issued},       {"applied", l.applied},        {"pending", l.pending},
          {"late", l.late},           {"failed", l.failed},          {"discarded", l.discarded},
          {"duplicate", l.duplicate}, {"rejected", l.rejected},      {"unasked", l.unasked},
          {"reissued", l.reissued},   {"conflicting", l.conflicting}};
}

json to_json_value(const WorkerRecord& w) {
  return {{"host", w.host},
          {"pid", w.pid},
          {"evaluators", w.num_evaluators},
          {"accepted", w.num_accepted},
          {"first_heard_s", w.first_heard_s},
          {"last_heard_s", w.last_heard_s}};
}

}  // namespace

std::string to_table(const std::vector<ConditionSummary>& conditions) {
  std::vector<Row> rows;
  rows.push_back({"condition", "runs", "start", "mean best", "95 % interval", "median", "best",
                  "final", "95 % interval", "roll-outs", "failed", "switches", "first switch"});
  for (const ConditionSummary& condition : conditions) rows.push_back(to_row(condition));
  std::array<std::size_t, kNumColumns> widths{};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < kNumColumns; ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Row& row : rows) {
    text += fmt::format("{:<{}}", row[0], widths[0]);
    for (std::size_t i = 1; i < kNumColumns; ++i) {
      text += fmt::format("  {:>{}}", row[i], widths[i]);
    }
    text += '\n';
  }
  for (const ConditionSummary& condition : conditions) {
    for (const std::string& remark : remarks(condition)) text += remark + '\n';
  }
  return text;
}

std::string to_json(const StudySummary& summary) {
  json conditions = json::array();
  for (const ConditionSummary& condition : summary.conditions) {
    conditions.push_back(to_json_value(condition));
  }
  json workers = json::array();
  for (const WorkerRecord& worker : summary.workers) workers.push_back(to_json_value(worker));
  const json whole = {{"study", summary.study},
                      {"seconds", summary.elapsed_s},
                      {"conditions", conditions},
                      {"ledger", to_json_value(summary.ledger)},
                      {"workers", workers},
                      {"numeric_classes", summary.results_by_class},
                      {"rechecks", to_json_value(summary.rechecks)}};
  // A host name comes from the network: what is not UTF-8 in it is replaced.
  return whole.dump(2, ' ', false, json::error_handler_t::replace);
}

}  // namespace treeroll
