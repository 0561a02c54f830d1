#include "learner/core/waiting.h"

#include <fmt/format.h>

#include <algorithm>

namespace treeroll::learner {
namespace {

constexpr Duration kPatience = std::chrono::seconds(3);

}  // namespace

std::string why_waiting(const Study& study, const std::vector<ContentHash>& task_ids,
                        const Workforce& workforce, std::size_t num_at_switch, TimePoint now) {
  const Ledger& ledger = workforce.ledger();
  const std::map<protocol::WorkerId, WorkerEntry>& workers = workforce.workers().all();
  const Duration silence = now - workforce.last_progress();
  if (silence < kPatience) return "";
  if (workforce.journal_is_behind()) {
    return fmt::format("the disk lags: {} results are not on stable storage yet",
                       workforce.num_unsynced());
  }
  if (workers.empty()) return "no workers: none is heard on this LCM URL";

  int usable = 0;
  int deaf = 0;
  bool has_room = false;
  for (const auto& [id, worker] : workers) {
    usable += worker.usable();
    deaf += worker.hearing.seems_deaf(now);
    has_room = has_room || (worker.usable() && worker.free_slots > 0);
  }
  const auto is_other = [](const auto& entry) { return entry.second.other_class; };
  if (usable == 0 && std::any_of(workers.begin(), workers.end(), is_other)) {
    return fmt::format("none of the {} workers takes roll-outs: the study demands numeric class {}",
                       workers.size(), workforce.classes().demanded().value_or("one"));
  }
  if (deaf == static_cast<int>(workers.size())) {
    return fmt::format(
        "{} workers are heard and none answers: does what we send reach them? treeroll-doctor "
        "there shows it",
        deaf);
  }
  if (usable == 0) {
    return fmt::format(
        "none of the {} workers takes roll-outs: they start, drain, are distrusted, were outvoted "
        "(study.recheck) or refuse too much",
        workers.size());
  }
  for (std::size_t c = 0; c < task_ids.size(); ++c) {
    const std::string& condition = study.conditions[c].name;
    if (const auto reason = workforce.refused_by_all(task_ids[c])) {
      return fmt::format("the workers lack the task of condition {}: {}", condition, *reason);
    }
    if (!workforce.facts_of(task_ids[c])) {
      return fmt::format("no worker has described the task of condition {} yet", condition);
    }
  }
  for (const protocol::RolloutKey key : ledger.ready()) {
    if (const auto reason = workforce.refused_by_all(ledger.find(key)->question.policy_id)) {
      return fmt::format("the workers refuse the policy of run {}: {}", key.run, *reason);
    }
  }
  if (num_at_switch > 0) {
    return fmt::format("the starts of the next layers of {} runs are computed", num_at_switch);
  }
  if (ledger.num_leased() > 0) {
    if (silence < workforce.patience()) return "";
    return fmt::format("{} roll-outs are with {} workers, nothing has come for {:.0f} s",
                       ledger.num_leased(), usable, to_seconds(silence));
  }
  if (!has_room) return fmt::format("queue full: none of the {} workers has room", usable);
  return fmt::format("all leases have expired, {} roll-outs wait to be issued again",
                     ledger.ready().size());
}

}  // namespace treeroll::learner
