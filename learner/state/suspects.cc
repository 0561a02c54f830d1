#include "learner/state/suspects.h"

#include <fmt/format.h>

#include "common/base/csv_field.h"
#include "common/files/atomic_file.h"

namespace treeroll {

std::set<protocol::WorkerId> suspects_of(const RecheckRecord& rechecks) {
  std::set<protocol::WorkerId> suspects;
  for (const auto& [id, tally] : rechecks.workers) {
    if (tally.num_outvoted > 0) suspects.insert(id);
  }
  return suspects;
}

void write_suspects(const StateFiles& files, const StateStudy& state, const RecheckRecord& rechecks,
                    const std::filesystem::path& directory) {
  const std::set<protocol::WorkerId> suspects = suspects_of(rechecks);
  if (suspects.empty()) {  // nor one of before
    std::filesystem::remove(directory / "suspects.csv");
    return;
  }
  const Study& study = state.loaded.study;
  AtomicFile file(directory / "suspects.csv");
  file.append("condition,repetition,run,rollout,reward,status,worker,host,pid\n");
  read_numbered(
      files.journal, state.in_journal, study.repetitions, [&](const NumberedRecord& numbered) {
        const auto* result = std::get_if<AcceptedResult>(&numbered.record);
        if (!result || !suspects.contains(result->worker_id)) return;
        const KnownWorker& worker = rechecks.workers.at(result->worker_id).worker;
        const int run = result->key.run;
        const auto condition = static_cast<std::size_t>(run / study.repetitions);
        file.append(fmt::format(
            "{},{},{},{},{},{},{},{},{}\n", csv_field(study.conditions[condition].name),
            run % study.repetitions, run, result->key.number, result->outcome.reward(),
            name(result->outcome.status()), result->worker_id, csv_field(worker.host), worker.pid));
      });
  file.commit();
}

}  // namespace treeroll
