#include "learner/report/noise_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

#include "learner/core/run.h"
#include "learner/explore/layer_start.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"
#include "learner/state/state_study.h"

namespace treeroll::report {
namespace {

struct Told {
  int number = 0;
  Outcome outcome;
};

/// What a run was told, in the order in which it was applied.
struct ToldRun {
  std::vector<Told> results;
  std::size_t num_before_stop = std::numeric_limits<std::size_t>::max();  ///< by the study's time
};

std::vector<ToldRun> by_number(const Study& study, const StudyResults& results) {
  std::vector<ToldRun> told(results.runs.size());
  for (std::size_t run = 0; run < told.size(); ++run) {
    const std::vector<RolloutRecord>& rollouts = results.runs[run].rollouts;
    for (std::size_t i = 0; i < rollouts.size(); ++i) {
      if (!is_applied(rollouts[i])) continue;
      const Told result{static_cast<int>(i), {rollouts[i].reward, rollouts[i].status}};
      // One that was given up has been discarded so often, and once more.
      const int num_trials = result.outcome.is_discarded() ? study.discards_max + 1 : 1;
      told[run].results.insert(told[run].results.end(), num_trials, result);
    }
  }
  return told;
}

/// Of results that came in this order, those that could be applied in sequence.
std::size_t num_in_sequence(const Study& study, const std::vector<Told>& results) {
  std::set<int> numbers;
  std::map<int, int> num_discards;
  for (const Told& result : results) {
    const bool is_tried_again =
        result.outcome.is_discarded() && (learner::is_unattended(result.outcome) ||
                                          ++num_discards[result.number] <= study.discards_max);
    if (!is_tried_again) numbers.insert(result.number);
  }
  int next = 0;
  while (numbers.contains(next)) ++next;
  return static_cast<std::size_t>(next);
}

/// With the place among them at which the study's time was up.
std::vector<ToldRun> as_they_arrived(const Study& study, const StudyResults& results) {
  std::vector<ToldRun> told(results.runs.size());
  bool time_is_up = false;
  const auto on_record = [&](const NumberedRecord& numbered) {
    const JournalRecord& record = numbered.record;
    const auto* time = std::get_if<LearningTime>(&record);
    if (time && study.stop_after && !time_is_up && time->elapsed >= *study.stop_after) {
      time_is_up = true;
      for (ToldRun& run : told) {
        run.num_before_stop =
            study.in_sequence ? num_in_sequence(study, run.results) : run.results.size();
      }
    }
    const auto* result = std::get_if<AcceptedResult>(&record);
    if (result == nullptr || result->key.number < 0) return;
    if (result->key.run < 0 || static_cast<std::size_t>(result->key.run) >= told.size()) return;
    // What a learner has written since the results were read is none of them.
    const RunRecord& run = results.runs[static_cast<std::size_t>(result->key.run)];
    const auto number = static_cast<std::size_t>(result->key.number);
    if (number >= run.rollouts.size() || !is_applied(run.rollouts[number])) return;
    told[static_cast<std::size_t>(result->key.run)].results.push_back(
        {result->key.number, result->outcome});
  };
  const StateFiles files{results.directory, journal_of(results.directory)};
  read_numbered(files.journal, read_state_study(files).in_journal, study.repetitions, on_record);
  return told;
}

std::vector<ToldRun> what_was_told(const Study& study, const StudyResults& results) {
  if (study.in_sequence && !study.stop_after) return by_number(study, results);
  std::vector<ToldRun> arrived = as_they_arrived(study, results);
  if (!study.in_sequence) return arrived;
  std::vector<ToldRun> told = by_number(study, results);
  for (std::size_t run = 0; run < told.size(); ++run) {
    told[run].num_before_stop = arrived[run].num_before_stop;
  }
  return told;
}

/// Root of the mean variance, each in units of the element's noise variance.
double level(const explore::Exploration& exploration, const Eigen::VectorXd& noise_variance) {
  return std::sqrt((exploration.noise().diagonal().array() / noise_variance.array()).mean());
}

/// @param first  where the runs of its condition begin
std::vector<double> levels(const Study& study, const RunRecord& record, const ToldRun& told,
                           const explore::LayerStart& first) {
  const auto require = [&record](bool holds) {
    if (holds) return;
    throw std::runtime_error(
        fmt::format("the results of {}, repetition {}, do not follow from the "
                    "study by this version of the algorithm",
                    record.condition, record.repetition));
  };
  learner::Run run(study, record.run, first);
  Eigen::VectorXd noise_variance = first.noise_variance;
  int layer = run.exploration().layer();
  std::set<int> asked;
  std::vector<double> found;
  for (std::size_t i = 0; i < told.results.size(); ++i) {
    const Told& result = told.results[i];
    if (i == told.num_before_stop) run.stop();
    for (const explore::Draw& draw : run.take_draws()) asked.insert(draw.rollout);
    require(asked.erase(result.number) == 1);
    if (run.accept(result.number, result.outcome, 0) == 0) continue;  // discarded
    if (run.exploration().layer() != layer) {
      layer = run.exploration().layer();
      const Condition& condition = study.conditions[static_cast<std::size_t>(run.condition())];
      noise_variance = explore::fresh_start(condition.exploration, run.exploration().policy(layer))
                           .noise_variance;
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
  const std::vector<ToldRun> told = what_was_told(study, results);
  for (std::size_t c = 0; c < study.conditions.size(); ++c) {
    const explore::LayerStart first =
        explore::first_start(study.conditions[c].exploration, *study.conditions[c].start);
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
      found[record.condition].push_back(levels(study, record, told[run], first));
    }
  }
  return found;
}

}  // namespace treeroll::report
