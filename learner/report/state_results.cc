#include "learner/report/state_results.h"

#include <spdlog/spdlog.h>

#include <optional>
#include <utility>

#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;

bool has_tables(const fs::path& directory) {
  return fs::is_regular_file(directory / "runs.csv") &&
         fs::is_regular_file(directory / "rollouts.csv");
}

/// Nothing of a journal that is not there or damaged.
std::optional<JournalTail> tail_of(const fs::path& journal) {
  if (!fs::is_regular_file(journal)) return std::nullopt;
  const Result<JournalTail> tail = read_journal(journal, [](const JournalRecord&) {});
  return tail ? std::optional(*tail) : std::nullopt;
}

/// Nothing of a study that cannot be read here, where its tables can: one of an earlier version
/// whose demonstration is gone, say.
std::optional<StateStudy> study_beside_tables(const StateFiles& files, bool has_journal) {
  try {
    if (has_journal) return read_state_study(files);
    StateStudy state;
    state.loaded = load_resolved_study(study_of(files.directory));
    return state;
  } catch (const StudyError& error) {
    spdlog::warn("its tables are read without the study: {}", error.what());
    return std::nullopt;
  }
}

/// What study.toml knows of its runs.
void add_facts(const Study& study, StudyResults& results) {
  results.determinism = determinism_of(study);
  for (const Condition& condition : study.conditions) {
    const explore::ExplorationSettings& settings = condition.exploration;
    results.endings[condition.name] = {
        .budget = settings.num_rollouts,
        .stop_at_reward = settings.stop_at_reward,
        .is_on_convergence = settings.stop_on_convergence && !study.stop_after};
  }
}

StudyResults results_of_journal(const StateFiles& files) {
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  fold_state(files, state, TimePoint{}, core);
  StudyResults results{.name = read_study_name(study_of(files.directory)),
                       .directory = files.directory,
                       .runs = std::move(core).run_records()};
  add_facts(state.loaded.study, results);
  results.missing = what_is_missing(state.loaded.study, results.runs);
  return results;
}

}  // namespace

StudyResults read_state_results(const fs::path& directory) {
  const StateFiles files{directory, journal_of(directory)};
  const std::string name = read_study_name(study_of(directory));
  // Of a journal that is damaged the files may stand all the same: they were written before.
  const std::optional<JournalTail> tail = tail_of(files.journal);
  if (!has_tables(directory) || (tail && !tail->sealed)) return results_of_journal(files);
  const std::optional<StateStudy> state = study_beside_tables(files, tail.has_value());
  // Those of a study that has been extended since are those of the study before.
  if (state && state->in_journal.is_before_extension) return results_of_journal(files);
  StudyResults results = read_study_results(directory);
  results.name = name;
  if (state) {
    add_facts(state->loaded.study, results);
    if (tail) results.missing = what_is_missing(state->loaded.study, results.runs);
  }
  return results;
}

}  // namespace treeroll::report
