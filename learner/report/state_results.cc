#include "learner/report/state_results.h"

#include <algorithm>

#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;

/// Of a journal that is damaged the files may stand all the same: they were written before. Of one
/// whose study has been extended they are those of the study before, sealed or not.
bool has_complete_files(const StateFiles& files) {
  for (const char* file : {"runs.csv", "rollouts.csv"}) {
    if (!fs::is_regular_file(files.directory / file)) return false;
  }
  if (!fs::is_regular_file(files.journal)) return true;
  const Result<JournalTail> tail = read_journal(files.journal, [](const JournalRecord&) {});
  if (!tail) return true;
  return tail->sealed && !read_state_study(files).in_journal.is_before_extension;
}

}  // namespace

StudyResults read_state_results(const fs::path& directory) {
  const StateFiles files{directory, journal_of(directory)};
  const std::string name = read_study_name(study_of(directory));
  if (!has_complete_files(files)) {
    const StateStudy state = read_state_study(files);
    learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
    fold_state(files, state, TimePoint{}, core);
    StudyResults results{
        .name = name, .directory = directory, .runs = std::move(core).run_records()};
    results.determinism = determinism_of(state.loaded.study);
    results.missing = what_is_missing(state.loaded.study, results.runs);
    return results;
  }
  StudyResults results = read_study_results(directory);
  results.name = name;
  try {
    results.determinism = determinism_of(load_study(study_of(directory), {}).study);
  } catch (const StudyError&) {
    // Of a study that another program has written the tables are read all the same.
  }
  const bool all_ended = std::all_of(results.runs.begin(), results.runs.end(),
                                     [](const RunRecord& run) { return run.final_reward; });
  if (!all_ended && fs::is_regular_file(files.journal)) {
    results.missing = what_is_missing(read_state_study(files).loaded.study, results.runs);
  }
  return results;
}

}  // namespace treeroll::report
