#include "learner/app/replayed_policy.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/files/atomic_file.h"

namespace treeroll {
namespace {

constexpr const char* kRolloutOption = "--policy";

void write(const std::string& policy, const std::filesystem::path& output_file) {
  if (!output_file.empty()) return write_atomically(output_file, policy);
  fmt::print("{}\n", policy);
}

std::optional<int> integer(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// What the study calls them; else what workers have told, which the journal holds.
SignalNames signals_of(const Condition& condition, const std::filesystem::path& journal) {
  SignalNames names = condition.signals;
  if (!names.empty()) return names;
  const ContentHash task_id = content_hash(condition.task_content);
  const Result<JournalTail> tail = read_journal(journal, [&](const JournalRecord& record) {
    const auto* signals = std::get_if<TaskSignals>(&record);
    if (signals && signals->task_id == task_id) names = signals->names;
  });
  if (!tail) throw std::runtime_error(tail.error().message);
  return names;
}

/// The policy of a roll-out that has been drawn and has no result yet; nothing if there is none.
std::optional<std::string> policy_of(const learner::LearnerCore& core, protocol::RolloutKey key) {
  const learner::Ledger::Entry* open = core.ledger().find(key);
  if (!open) return std::nullopt;
  const learner::Run& run = core.runs()[static_cast<std::size_t>(key.run)];
  const Policy& policy = run.exploration().policy(run.layer_of(key.number));
  try {
    return to_json(*policy.with(open->question.theta),
                   core.study().conditions[static_cast<std::size_t>(run.condition())].signals);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("theta of run {} roll-out {} makes no policy: {}", key.run,
                                         key.number, error.what()));
  }
}

}  // namespace

protocol::RolloutKey read_rollout_key(const std::string& option, const std::string& rollout,
                                      int num_runs) {
  const std::size_t colon = rollout.find(':');
  const std::string_view text = rollout;
  const auto run = integer(text.substr(0, colon));
  const auto number = colon == std::string::npos ? std::nullopt : integer(text.substr(colon + 1));
  if (!run || !number) {
    throw ConfigError(option, rollout, "must be RUN:ROLLOUT, two whole numbers");
  }
  if (*run < 0 || *run >= num_runs) {
    throw ConfigError(option, rollout, fmt::format("the study has the runs 0 to {}", num_runs - 1));
  }
  return {*run, *number};
}

void write_policy_of_rollout(const StateFiles& files, const std::string& rollout,
                             const std::filesystem::path& output_file) {
  const StateStudy state = read_state_study(files);
  const protocol::RolloutKey key =
      read_rollout_key(kRolloutOption, rollout, state.loaded.study.num_runs());
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  std::optional<std::string> policy;
  fold_state(files, state, TimePoint{}, core, {.before = [&](const JournalRecord& record) {
               const auto* result = std::get_if<AcceptedResult>(&record);
               if (result && result->key == key) policy = policy_of(core, key);
             }});
  if (!policy) policy = policy_of(core, key);
  if (!policy) {
    throw ConfigError(
        kRolloutOption, rollout,
        fmt::format("must be a roll-out of the journal: run {} has {} results so far", key.run,
                    core.runs()[static_cast<std::size_t>(key.run)].exploration().num_told()));
  }
  write(*policy, output_file);
}

void write_start_policy(const StateFiles& files, const std::string& condition,
                        const std::filesystem::path& output_file) {
  const StateStudy state = read_state_study(files);
  std::string names;
  for (const Condition& known : state.loaded.study.conditions) {
    if (known.name == condition) {
      return write(to_json(*known.start, signals_of(known, files.journal)), output_file);
    }
    names += (names.empty() ? "" : ", ") + known.name;
  }
  throw ConfigError("--start", condition, "must be a condition of the study: " + names);
}

}  // namespace treeroll
