#include "learner/core/task_accounts.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

/// What has the most votes; `now` where nothing has more than that.
template <class What>
What most(const std::map<What, std::size_t>& votes, What now) {
  const auto of_now = votes.find(now);
  std::size_t most_votes = of_now == votes.end() ? 0 : of_now->second;
  for (const auto& [what, num_votes] : votes) {
    if (num_votes <= most_votes) continue;
    most_votes = num_votes;
    now = what;
  }
  return now;
}

}  // namespace

void TaskAccounts::note(const ContentHash& task, protocol::WorkerId worker,
                        const TaskDescription& said) {
  std::map<Account, Workers>& of_task = accounts_[task];
  for (auto& [other, workers] : of_task) workers.erase(worker);
  std::erase_if(of_task, [](const auto& entry) { return entry.second.empty(); });
  const Account account = account_of(said);
  if (of_task.size() >= protocol::kDescriptionsMax && !of_task.contains(account)) return;
  of_task[account].insert(worker);
}

void TaskAccounts::forget(protocol::WorkerId worker) {
  for (auto& [task, of_task] : accounts_) {
    for (auto& [account, workers] : of_task) workers.erase(worker);
    std::erase_if(of_task, [](const auto& entry) { return entry.second.empty(); });
  }
}

TaskAccounts::Workers TaskAccounts::drop(const ContentHash& task, const Account& account) {
  auto dropped = accounts_.at(task).extract(account);
  return dropped.empty() ? Workers{} : std::move(dropped.mapped());
}

TaskAccounts::Account TaskAccounts::most_say(const ContentHash& task, const Account& now) const {
  const auto found = accounts_.find(task);
  if (found == accounts_.end()) return now;
  std::map<std::string, std::size_t> votes;
  for (const auto& [account, workers] : found->second) votes[account.description] += workers.size();
  Account chosen{.description = most(votes, now.description), .names = {}};
  std::map<SignalNames, std::size_t> named;
  for (const auto& [account, workers] : found->second) {
    if (account.description != chosen.description || account.names.empty()) continue;
    named[account.names] = workers.size();
  }
  const bool is_as_now = chosen.description == now.description;
  chosen.names = most(named, is_as_now ? now.names : SignalNames{});
  return chosen;
}

TaskAccounts::Account account_of(const TaskDescription& description) {
  return {.description = to_json(description).dump(), .names = description.signals};
}

TaskDescription description_of(const TaskAccounts::Account& account) {
  Result<TaskDescription> description = task_description_from_json(account.description);
  CHECK(description, "an account was read before it was kept");
  description->signals = account.names;
  return *std::move(description);
}

}  // namespace treeroll::learner
