#pragma once

#include <compare>
#include <map>
#include <set>
#include <string>

#include "common/base/content_hash.h"
#include "common/protocol/messages.h"
#include "common/task_facts/task_description.h"

namespace treeroll::learner {

/// What workers say of tasks that nobody knew beforehand, and which of it is believed: what most of
/// them say. Each worker has one vote.
class TaskAccounts {
 public:
  struct Account {
    std::string description;  ///< as to_json() has it: without names
    SignalNames names;        ///< empty: it names none
    auto operator<=>(const Account&) const = default;
  };
  using Workers = std::set<protocol::WorkerId>;

  /// In place of what this worker has said of the task before. Of more than kDescriptionsMax
  /// different accounts further ones count for nothing.
  void note(const ContentHash& task, protocol::WorkerId worker, const TaskDescription& said);
  void forget(protocol::WorkerId worker);
  /// Nobody is to go by this account. @return  who has given it
  Workers drop(const ContentHash& task, const Account& account);

  /// Whether anybody has said something of it, ever.
  bool has(const ContentHash& task) const { return accounts_.contains(task); }
  /// Those of a task, and who gives each.
  const std::map<Account, Workers>& of(const ContentHash& task) const { return accounts_.at(task); }
  /// The description that most give, with the names that most of these give who name any. Of as
  /// many votes what is believed now stays. Precondition: has(task), or something is believed.
  Account most_say(const ContentHash& task, const Account& now) const;

 private:
  std::map<ContentHash, std::map<Account, Workers>> accounts_;
};

TaskAccounts::Account account_of(const TaskDescription& description);
TaskDescription description_of(const TaskAccounts::Account& account);

}  // namespace treeroll::learner
