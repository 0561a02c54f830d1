#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "learner/results/summary.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kNumColumns = 11;
using Row = std::array<std::string, kNumColumns>;

std::string shown(const std::optional<double>& figure, int decimals) {
  return figure ? fmt::format("{:.{}f}", *figure, decimals) : "-";
}

Row to_row(const ConditionSummary& c) {
  return {c.condition,
          std::to_string(c.num_runs),
          shown(c.mean_best_reward, 3),
          c.interval_95 ? fmt::format("[{:.3f}, {:.3f}]", c.interval_95->low, c.interval_95->high)
                        : "-",
          shown(c.median_best_reward, 3),
          shown(c.best_reward, 3),
          shown(c.mean_final_reward, 3),
          std::to_string(c.num_rollouts),
          std::to_string(c.num_failed),
          fmt::format("{} in {}/{}", c.num_switches, c.num_runs_switched, c.num_runs),
          shown(c.median_first_switch, 1)};
}

template <class T>
json or_null(const std::optional<T>& figure) {
  return figure ? json(*figure) : json();
}

json to_json_value(const ConditionSummary& c) {
  return {{"condition", c.condition},
          {"runs", c.num_runs},
          {"mean_best_reward", or_null(c.mean_best_reward)},
          {"interval_95",
           c.interval_95 ? json::array({c.interval_95->low, c.interval_95->high}) : json()},
          {"median_best_reward", or_null(c.median_best_reward)},
          {"best_reward", or_null(c.best_reward)},
          {"mean_final_reward", or_null(c.mean_final_reward)},
          {"rollouts", c.num_rollouts},
          {"failed", c.num_failed},
          {"switches", c.num_switches},
          {"runs_switched", c.num_runs_switched},
          {"median_first_switch", or_null(c.median_first_switch)}};
}

json to_json_value(const LedgerCounters& l) {
  return {{"issued", l.issued},     {"applied", l.applied},   {"pending", l.pending},
          {"late", l.late},         {"failed", l.failed},     {"duplicate", l.duplicate},
          {"rejected", l.rejected}, {"reissued", l.reissued}, {"conflicting", l.conflicting}};
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
  rows.push_back({"condition", "runs", "mean best", "95 % interval", "median", "best", "final",
                  "roll-outs", "failed", "switches", "first switch"});
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
  return text;
}

std::string to_json(const StudySummary& summary) {
  json conditions = json::array();
  for (const ConditionSummary& condition : summary.conditions) {
    conditions.push_back(to_json_value(condition));
  }
  json workers = json::array();
  for (const WorkerRecord& worker : summary.workers) workers.push_back(to_json_value(worker));
  const json whole = {{"study", summary.study},   {"seconds", summary.elapsed_s},
                      {"conditions", conditions}, {"ledger", to_json_value(summary.ledger)},
                      {"workers", workers},       {"numeric_classes", summary.results_by_class}};
  // A host name comes from the network: what is not UTF-8 in it is replaced.
  return whole.dump(2, ' ', false, json::error_handler_t::replace);
}

}  // namespace treeroll
