// What changes from second to second: progress, ledger, conditions, workers, failures.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "learner/web/views/view_text.h"
#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

using learner::LearnerCore;
using learner::Run;
using nlohmann::json;

/// More workers than these a page does not list; the totals count all.
constexpr std::size_t kWorkersShownMax = 300;
constexpr std::size_t kFailuresShownMax = 60;
constexpr std::size_t kReasonsShownMax = 20;

const char* stage(const LiveStudy& study) {
  switch (study.core().outcome()) {
    case LearnerCore::Outcome::kDone:
      return "done";
    case LearnerCore::Outcome::kStopped:
      return "stopped";
    case LearnerCore::Outcome::kFailed:
      return "failed";
    case LearnerCore::Outcome::kRunning:
      break;
  }
  return study.facts().is_replay ? "replay" : "learning";
}

json ledger_view(const LedgerCounters& counters, const LearnerCore& core) {
  return {{"issued", counters.issued},
          {"applied", counters.applied},
          {"pending", counters.pending},
          {"leased", core.ledger().num_leased()},
          {"ready", core.ledger().ready().size()},
          {"late", counters.late},
          {"duplicate", counters.duplicate},
          {"failed", counters.failed},
          {"discarded", counters.discarded},
          {"rejected", counters.rejected},
          {"unasked", counters.unasked},
          {"reissued", counters.reissued},
          {"conflicting", counters.conflicting},
          {"unsynced", core.workforce().num_unsynced()}};
}

/// What keeps a worker from work, or slows it; empty: nothing.
std::string trouble_of(const learner::WorkerEntry& worker, bool is_outvoted, TimePoint now) {
  if (worker.set_aside) return "two others contradict its answers: it gets nothing of this study";
  if (worker.distrusted && is_outvoted) {
    return "two others contradict its answers: it gets nothing for a while";
  }
  if (worker.distrusted) return "distrusted for a while: it gave a reward that no sound one gives";
  if (worker.suspicion) return "suspected: it has to say whether a reward was its own";
  if (worker.other_class) return "its numeric class is not the one that the study demands";
  if (worker.hearing.seems_deaf(now))
    return "it is heard and does not answer: do messages reach it?";
  if (!worker.refused.empty()) return "it refuses: " + worker.refused.begin()->second.reason;
  if (!worker.is_alive(now)) return "silent";
  if (worker.draining) return "it drains: it takes no more roll-outs";
  if (!worker.hearing.hears()) return "greeted, it has not replied yet";
  if (!worker.hearing.is_first_choice()) return "it has lost leases: it gets less";
  if (worker.late) return "late: others were given what it holds";
  return "";
}

json worker_view(protocol::WorkerId id, const learner::WorkerEntry* entry, const SeenWorker* seen,
                 const LiveStudy& study, TimePoint now) {
  json view{{"id", std::to_string(id)}};
  const auto& rechecked = study.core().workforce().rechecks().record().workers;
  const auto tally = rechecked.find(id);
  const bool is_outvoted = tally != rechecked.end() && tally->second.num_outvoted > 0;
  if (tally != rechecked.end()) {
    view.update({{"compared", tally->second.num_compared},
                 {"disagreed", tally->second.num_disagreed},
                 {"outvoted", tally->second.num_outvoted}});
  }
  if (seen) {
    view.update({{"host", seen->host},
                 {"pid", seen->pid},
                 {"accepted", seen->num_accepted},
                 {"failed", seen->num_failed},
                 {"last_failure", seen->last_failure},
                 {"rate_per_s", entry ? seen->rate_per_s : 0.},
                 {"held", seen->num_held}});
    if (seen->status) {
      view.update({{"version", seen->status->version},
                   {"restarts", seen->status->num_restarts},
                   {"repeated", seen->status->num_repeated},
                   {"refused_datagrams", seen->status->num_rejected}});
    }
  }
  if (!entry) {
    view["trouble"] = study.facts().is_replay ? "" : "gone";
    if (is_outvoted) view["trouble"] = "two others contradict its answers";
    view["gone"] = true;
    return view;
  }
  view.update({{"host", entry->host},
               {"pid", entry->pid},
               {"evaluators", entry->num_evaluators},
               {"class", entry->numeric_class},
               {"in_flight", study.core().ledger().leases_of(id).size()},
               {"silent_s", to_seconds(now - entry->last_heard)},
               {"trouble", trouble_of(*entry, is_outvoted, now)}});
  if (entry->answer_time_s) view["answer_s"] = *entry->answer_time_s;
  return view;
}

json workers_view(const LiveStudy& study, TimePoint now) {
  json view = json::array();
  const auto& present = study.core().workforce().workers().all();
  const auto& seen = study.workers();
  for (const auto& [id, entry] : present) {
    if (view.size() == kWorkersShownMax) return view;
    const auto found = seen.find(id);
    view.push_back(
        worker_view(id, &entry, found == seen.end() ? nullptr : &found->second, study, now));
  }
  for (const auto& [id, what] : seen) {
    if (view.size() == kWorkersShownMax) return view;
    if (present.contains(id) || what.num_accepted == 0) continue;
    view.push_back(worker_view(id, nullptr, &what, study, now));
  }
  return view;
}

json rechecks_view(const RecheckRecord& record) {
  const auto num_outvoted = std::ranges::count_if(
      record.workers, [](const auto& worker) { return worker.second.num_outvoted > 0; });
  return {{"rechecked", record.num_rechecked},
          {"disputed", record.num_disputed},
          {"undecided", record.num_undecided},
          {"outvoted_workers", num_outvoted}};
}

/// What runs of one condition have come to.
struct ConditionTotals {
  int num_done = 0;
  std::int64_t num_applied = 0;
  std::int64_t num_rollouts = 0;
  std::int64_t num_failed = 0;
  int num_with_result = 0;
  double sum_of_bests = 0;
  const Run* best = nullptr;
  std::vector<int> runs_by_layer;
  std::vector<std::vector<double>> switches;  ///< roll-outs, by switch
};

void add(const Run& run, const Condition& condition, ConditionTotals& totals) {
  const explore::Exploration& exploration = run.exploration();
  totals.num_done += run.done();
  totals.num_applied += exploration.num_told();
  totals.num_rollouts +=
      exploration.done() ? exploration.num_told() : condition.exploration.num_rollouts;
  totals.num_failed += run.num_failed();
  const auto layer = static_cast<std::size_t>(exploration.layer());
  if (totals.runs_by_layer.size() < layer) totals.runs_by_layer.resize(layer);
  ++totals.runs_by_layer[layer - 1];
  const std::vector<int>& switches = exploration.switches();
  if (totals.switches.size() < switches.size()) totals.switches.resize(switches.size());
  for (std::size_t i = 0; i < switches.size(); ++i) totals.switches[i].push_back(switches[i] + 1);
  if (exploration.best().rollout < 0) return;
  ++totals.num_with_result;
  totals.sum_of_bests += exploration.best().reward;
  if (!totals.best || exploration.best().reward > totals.best->exploration().best().reward) {
    totals.best = &run;
  }
}

json condition_state(const Condition& condition, ConditionTotals& totals) {
  json view{{"name", condition.name},
            {"done", totals.num_done},
            {"applied", totals.num_applied},
            {"rollouts", totals.num_rollouts},
            {"failed", totals.num_failed},
            {"runs_by_layer", totals.runs_by_layer},
            {"switches", json::array()},
            {"mean_best", nullptr},
            {"best", nullptr}};
  for (std::vector<double>& rollouts : totals.switches) {
    view["switches"].push_back({{"median", quantile(rollouts, .5)}, {"runs", rollouts.size()}});
  }
  if (!totals.best) return view;
  const explore::Exploration::Best& best = totals.best->exploration().best();
  view["mean_best"] = totals.sum_of_bests / totals.num_with_result;
  view["best"] = {{"run", totals.best->index()},
                  {"repetition", totals.best->repetition()},
                  {"rollout", best.rollout},
                  {"reward", best.reward}};
  return view;
}

json failures_view(const LiveStudy& study) {
  json view = json::array();
  const auto& failures = study.failures();
  for (auto each = failures.rbegin(); each != failures.rend(); ++each) {
    if (view.size() == kFailuresShownMax) break;
    const AcceptedResult& result = each->result;
    view.push_back({{"count", each->count},
                    {"run", result.key.run},
                    {"rollout", result.key.number},
                    {"status", name(result.outcome.status())},
                    {"reason", result.outcome.reason()},
                    {"worker", std::to_string(result.worker_id)}});
  }
  return view;
}

json reasons_view(const LiveStudy& study) {
  std::vector<std::pair<std::int64_t, std::string>> sorted;
  for (const auto& [reason, count] : study.reasons()) sorted.emplace_back(count, reason);
  std::sort(sorted.rbegin(), sorted.rend());
  if (sorted.size() > kReasonsShownMax) sorted.resize(kReasonsShownMax);
  json view = json::array();
  for (const auto& [count, reason] : sorted) {
    view.push_back({{"count", count}, {"reason", reason}});
  }
  return view;
}

}  // namespace

std::string state_view(const LiveStudy& study, TimePoint now) {
  const LearnerCore& core = study.core();
  std::vector<ConditionTotals> totals(core.study().conditions.size());
  for (const Run& run : core.runs()) {
    const auto place = static_cast<std::size_t>(run.condition());
    add(run, core.study().conditions[place], totals[place]);
  }
  const protocol::LearnerStatus status = study.status().value_or(protocol::LearnerStatus{});
  json view{{"incarnation", study.facts().incarnation},
            {"version", study.version()},
            {"stage", stage(study)},
            {"waiting_for", study.facts().is_replay ? "" : status.waiting_for},
            {"failure", core.failure()},
            {"last_failure", status.last_failure},
            {"elapsed_s", status.elapsed_s},
            {"runs", status.num_runs},
            {"runs_done", status.num_runs_done},
            {"rollouts", status.num_rollouts},
            {"evaluations", status.num_evaluations},
            {"evaluated", status.num_evaluated},
            {"workers_joined", status.num_workers},
            {"evaluators", status.num_evaluators},
            {"best_reward", status.best_reward},
            {"rate_per_s", nullptr},
            {"left_s", nullptr},
            {"rates", study.rates()},
            {"ledger", ledger_view(core.counters(), core)},
            {"conditions", json::array()},
            {"workers", workers_view(study, now)},
            {"num_workers", core.workforce().workers().all().size()},
            {"classes", core.results_by_class()},
            {"rechecks", rechecks_view(core.workforce().rechecks().record())},
            {"num_failures", study.num_failures()},
            {"failures", failures_view(study)},
            {"reasons", reasons_view(study)}};
  const std::optional<double> rate = study.rollouts_per_s();
  if (rate && *rate > 0 && !study.facts().is_replay) {
    const std::int64_t left =
        status.num_rollouts + status.num_evaluations - status.num_applied - status.num_evaluated;
    view["rate_per_s"] = *rate;
    view["left_s"] = static_cast<double>(left) / *rate;
  }
  for (std::size_t i = 0; i < totals.size(); ++i) {
    view["conditions"].push_back(condition_state(core.study().conditions[i], totals[i]));
  }
  return dumped(view);
}

}  // namespace treeroll::web
