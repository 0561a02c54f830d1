#include "learner/state/state_study.h"

#include <fmt/format.h>

#include <stdexcept>

#include "common/base/config_error.h"
#include "common/files/atomic_file.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"
#include "learner/study/study_extension.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

/// As study_id_of(), of what was read.
ContentHash id_of(const LoadedStudy& study) { return content_hash(study.text); }

/// All evaluations of its final policy are in. Its start may not have been evaluated: version 0.1.0
/// did not. Files of that version tell the final reward alone.
bool has_ended(const RunRecord& run, int final_evaluations) {
  return run.final_reward || run.finals.size() == static_cast<std::size_t>(final_evaluations);
}

LoadedStudy read_study(const fs::path& file, const ContentHash& id, const char* whose) {
  if (!fs::is_regular_file(file)) {
    throw std::runtime_error(
        fmt::format("{}: is missing: the journal tells of an extension of it", file.string()));
  }
  LoadedStudy study = load_resolved_study(file);
  if (id_of(study) != id) {
    throw std::runtime_error(fmt::format("{}: is not the study {}", file.string(), whose));
  }
  return study;
}

}  // namespace

fs::path earlier_study_of(const fs::path& directory, int extension) {
  return directory / fmt::format("study.before-extension-{}.toml", extension);
}

StateFiles state_files(const fs::path& path) {
  if (fs::is_directory(path)) return {path, journal_of(path)};
  return {path.parent_path(), path};
}

StateStudy read_state_study(const StateFiles& files, const std::vector<std::string>& overrides) {
  const fs::path file = study_of(files.directory);
  StateStudy state{
      .loaded = overrides.empty() ? load_resolved_study(file) : load_extended(file, overrides),
      .in_journal = {},
      .text_before = "",
      .extension = "",
      .num_extensions = 0};
  const ContentHash id = id_of(state.loaded);
  // The study first: of an extension in between, the journal then tells more than is asked of it.
  const JournalStudies studies = read_studies(files.journal);
  state.num_extensions = static_cast<int>(studies.extensions.size());
  LoadedStudy before;
  const fs::path earlier = earlier_study_of(files.directory, state.num_extensions + 1);
  if (studies.last() && *studies.last() != id && fs::is_regular_file(earlier)) {
    // A learner has ended between study.toml and the record of its extension.
    before = read_study(earlier, *studies.last(), "that the journal ends with");
  } else if (!overrides.empty()) {
    before = load_resolved_study(file);
  } else {
    state.in_journal = {.id = id, .repetitions = state.loaded.study.repetitions};
    return state;
  }
  check_extends(before, state.loaded, overrides.empty() ? file.string() : kCommandLineOrigin);
  state.in_journal = {.id = id_of(before), .repetitions = before.study.repetitions};
  state.extension = describe_extension(before.study, state.loaded.study);
  if (state.extension.empty()) return state;
  state.in_journal.is_before_extension = true;
  state.text_before = std::move(before.text);
  return state;
}

JournalTail fold_state(const StateFiles& files, const StateStudy& state, TimePoint now,
                       learner::LearnerCore& core, const FoldHooks& hooks) {
  return fold_journal(files.journal, state.in_journal, now, core, hooks);
}

std::string what_is_missing(const Study& study, const std::vector<RunRecord>& runs) {
  std::int64_t budget = 0;
  for (const Condition& condition : study.conditions) {
    budget += std::int64_t{condition.exploration.num_rollouts} * study.repetitions;
  }
  std::int64_t num_learnt = 0;
  std::size_t num_done = 0;
  for (const RunRecord& run : runs) {
    num_learnt += num_applied(run);
    num_done += has_ended(run, study.final_evaluations) ? 1 : 0;
  }
  if (num_done == runs.size()) return "";
  return fmt::format("{} of {} roll-outs are learnt and {} of {} runs have ended", num_learnt,
                     budget, num_done, runs.size());
}

JournalExtension write_extension(const StateFiles& files, const StateStudy& state,
                                 const std::string& program) {
  write_atomically(earlier_study_of(files.directory, state.num_extensions + 1), state.text_before);
  write_atomically(study_of(files.directory), state.loaded.resolved.to_toml(program));
  return {.study_id_before = state.in_journal.id,
          .study_id = study_id_of(files.directory),
          .repetitions_before = state.in_journal.repetitions,
          .repetitions = state.loaded.study.repetitions};
}

std::vector<std::string> verify_earlier_studies(const StateFiles& files, const StateStudy& state) {
  const JournalStudies studies = read_studies(files.journal);
  std::vector<LoadedStudy> earlier;
  const auto add = [&](const ContentHash& id, const char* whose) {
    const int number = static_cast<int>(earlier.size()) + 1;
    earlier.push_back(read_study(earlier_study_of(files.directory, number), id, whose));
  };
  for (const JournalExtension& extension : studies.extensions) {
    add(extension.study_id_before, "that the journal tells of");
  }
  if (state.in_journal.is_before_extension) {
    add(state.in_journal.id, "that the journal ends with");
  }
  std::vector<std::string> extensions;
  for (std::size_t i = 0; i < earlier.size(); ++i) {
    const LoadedStudy& loaded = earlier[i];
    const bool is_last = i + 1 == earlier.size();
    const LoadedStudy& next = is_last ? state.loaded : earlier[i + 1];
    const fs::path file = is_last ? study_of(files.directory)
                                  : earlier_study_of(files.directory, static_cast<int>(i) + 2);
    check_extends(loaded, next, file.string());
    learner::LearnerCore core(loaded.study, learner::LearnerSettings{});
    fold_journal(files.journal, {id_of(loaded), loaded.study.repetitions}, TimePoint{}, core);
    extensions.push_back(describe_extension(loaded.study, next.study));
  }
  return extensions;
}

}  // namespace treeroll
