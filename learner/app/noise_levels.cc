#include "learner/app/noise_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "learner/app/state_directory.h"
#include "learner/core/run.h"
#include "learner/explore/layer_start.h"
#include "learner/journal/journal_file.h"
#include "learner/report/run_counts.h"

namespace treeroll {
namespace {

struct Told {
  int number = 0;
  double reward = 0;
  RolloutStatus status = RolloutStatus::kOk;
};

/// Of the whole study, by run: results in the order in which they were applied.
using ByRun = std::vector<std::vector<Told>>;

ByRun by_number(const StudyResults& results) {
  ByRun told(results.runs.size());
  for (std::size_t run = 0; run < told.size(); ++run) {
    const std::vector<RolloutRecord>& rollouts = results.runs[run].rollouts;
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      if (!is_applied(rollouts[i])) continue;
      told[run].push_back({static_cast<int>(i), rollouts[i].reward, rollouts[i].status});
    }
  }
  return told;
}

ByRun as_they_arrived(const StudyResults& results) {
  ByRun told(results.runs.size());
  const Result<JournalTail> tail =
      read_journal(journal_of(results.directory), [&](const JournalRecord& record) {
        const auto* result = std::get_if<AcceptedResult>(&record);
        if (result == nullptr || result->key.number == Run::kEvaluation) return;
        if (result->key.run < 0 || static_cast<std::size_t>(result->key.run) >= told.size()) return;
        told[static_cast<std::size_t>(result->key.run)].push_back(
            {result->key.number, result->reward, result->status});
      });
  if (!tail) throw std::runtime_error(tail.error().message);
  return told;
}

/// Root of the mean variance, each in units of the element's noise variance.
double level(const Exploration& exploration, const Eigen::VectorXd& noise_variance) {
  return std::sqrt((exploration.noise().diagonal().array() / noise_variance.array()).mean());
}

std::vector<double> levels(const Study& study, const RunRecord& record,
                           const std::vector<Told>& told) {
  const auto require = [&record](bool holds) {
    if (holds) return;
    throw std::runtime_error(
        fmt::format("the results of {}, repetition {}, do not follow from the "
                    "study by this version of the algorithm",
                    record.condition, record.repetition));
  };
  Run run(study, record.run);
  const ExplorationSettings& settings =
      study.conditions[static_cast<std::size_t>(run.condition())].exploration;
  const auto unit = [&] {
    const Exploration& exploration = run.exploration();
    return fresh_start(settings, exploration.policy(exploration.layer())).noise_variance;
  };
  Eigen::VectorXd noise_variance = unit();
  int layer = run.exploration().layer();
  std::set<int> asked;
  std::vector<double> found;
  for (const Told& result : told) {
    for (const Run::Wanted& wanted : run.take_wanted()) asked.insert(wanted.number);
    require(asked.erase(result.number) == 1);
    run.accept(result.number, result.reward, result.status, 0);
    if (run.exploration().layer() != layer) {
      layer = run.exploration().layer();
      noise_variance = unit();
    }
    found.push_back(level(run.exploration(), noise_variance));
  }
  require(run.exploration().switches() == record.switches);
  return found;
}

}  // namespace

NoiseLevels noise_levels(const Study& study, const StudyResults& results,
                         std::int64_t rollouts_max) {
  std::int64_t rollouts_of_repetition = 0;
  for (const Condition& condition : study.conditions) {
    rollouts_of_repetition += condition.exploration.num_rollouts;
  }
  const auto num_repetitions = static_cast<int>(
      std::min<std::int64_t>(study.repetitions, rollouts_max / rollouts_of_repetition));
  NoiseLevels found;
  if (num_repetitions == 0) return found;
  if (static_cast<int>(results.runs.size()) != study.num_runs()) {
    throw std::runtime_error(fmt::format("runs.csv has {} runs, must have {} as the study",
                                         results.runs.size(), study.num_runs()));
  }
  const ByRun told = study.in_sequence ? by_number(results) : as_they_arrived(results);
  for (std::size_t c = 0; c < study.conditions.size(); ++c) {
    for (int repetition = 0; repetition < num_repetitions; ++repetition) {
      const std::size_t run =
          c * static_cast<std::size_t>(study.repetitions) + static_cast<std::size_t>(repetition);
      const RunRecord& record = results.runs[run];
      if (record.condition != study.conditions[c].name || record.repetition != repetition) {
        throw std::runtime_error(fmt::format(
            "run {} is of {}, repetition {}, in runs.csv, must be "
            "of {}, repetition {}",
            run, record.condition, record.repetition, study.conditions[c].name, repetition));
      }
      found[record.condition].push_back(levels(study, record, told[run]));
    }
  }
  return found;
}

}  // namespace treeroll
