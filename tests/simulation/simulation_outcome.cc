#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "learner/journal/journal_refold.h"
#include "learner/results/run_counts.h"
#include "tests/simulation/planted_fault.h"
#include "tests/simulation/reference.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

/// What a journal says of the ends of its runs, counted apart from the core.
struct Ends {
  std::set<protocol::RolloutKey> keys;  ///< of all results
  std::size_t num_results = 0;          ///< but for trials that were made again
  std::map<protocol::RolloutKey, int> num_discards;
  bool time_was_up = false;
  std::vector<int> num_applied;  ///< by run, when the time was up; empty if it was not
};

Ends ends_of(const Study& study, const std::vector<JournalRecord>& journal) {
  Ends ends;
  std::vector<int> num_applied(static_cast<std::size_t>(study.num_runs()));
  for (const JournalRecord& record : journal) {
    if (const auto* result = std::get_if<AcceptedResult>(&record)) {
      const bool is_discarded = result->outcome.is_discarded();
      if (is_discarded && ++ends.num_discards[result->key] <= study.discards_max) continue;
      ++ends.num_results;
      ends.keys.insert(result->key);
      const int run = result->key.run;
      int& applied = num_applied[static_cast<std::size_t>(run)];
      if (result->key.number < 0) continue;
      if (!study.in_sequence) ++applied;
      while (study.in_sequence && ends.keys.contains({run, applied})) ++applied;
    } else if (const auto* time = std::get_if<LearningTime>(&record)) {
      if (time->elapsed < *study.stop_after) continue;
      ends.time_was_up = true;
      ends.num_applied = num_applied;
    }
  }
  return ends;
}

}  // namespace

void Simulation::check_outcome(int index) {
  const LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  const Study& study = scenario_.studies[static_cast<std::size_t>(index)];
  const std::vector<RunRecord> records = slot.process->core().run_records();
  const std::optional<std::vector<JournalRecord>> journal = slot.disk.records();
  observer_.require(journal.has_value(), "the journal of a learner that has ended is not whole");
  if (!journal) return;
  const Ends ends = ends_of(study, *journal);
  if (ends.time_was_up) observer_.count("studies ended by their time");
  std::size_t expected = records.size() * (1 + static_cast<std::size_t>(study.final_evaluations));
  for (const RunRecord& run : records) expected += run.rollouts.size();
  observer_.require(ends.keys.size() == expected, "the journal has not each answer once");
  observer_.require(ends.num_results == expected, "the journal has an answer twice");
  for (const RunRecord& run : records) {
    const explore::ExplorationSettings& exploration = condition_of(study, run.run).exploration;
    const int num_drawn =
        ends.time_was_up
            ? std::min(exploration.num_rollouts,
                       ends.num_applied[static_cast<std::size_t>(run.run)] + exploration.in_flight)
            : exploration.num_rollouts;
    const bool is_given_up = num_with(run, RolloutStatus::kDiscarded) > 0;
    observer_.require(is_given_up ? run.rollouts.size() <= static_cast<std::size_t>(num_drawn)
                                  : run.rollouts.size() == static_cast<std::size_t>(num_drawn),
                      "a run has not exactly its roll-outs");
    observer_.require(std::none_of(run.rollouts.begin(), run.rollouts.end(),
                                   [](const auto& rollout) { return rollout.layer == 0; }),
                      "a roll-out has no result");
    observer_.require(run.start.has_value(), "a start policy is not evaluated");
    observer_.require(run.finals.size() == static_cast<std::size_t>(study.final_evaluations) &&
                          run.final_reward == mean_reward(run.finals),
                      "a run has no final evaluation");
    if (is_given_up) continue;
    if (!ends.time_was_up)
      observer_.require(exploration.convergence_slope < kAnySlope ||
                            static_cast<int>(run.switches.size()) == exploration.last_layer - 1,
                        "a run has not switched its layers");
    if (run.repetition == 0 || ends.time_was_up) continue;
    const std::vector<RolloutRecord>& others =
        records[static_cast<std::size_t>(run.run - run.repetition)].rollouts;
    observer_.require(
        !std::equal(run.rollouts.begin(), run.rollouts.end(), others.begin(), others.end(),
                    [](const auto& a, const auto& b) { return a.reward == b.reward; }),
        "two repetitions draw the same");
  }
  const auto compare = [&](const std::vector<RunRecord>& others, const char* rule) {
    for (std::size_t i = 0; i < records.size(); ++i) {
      observer_.require(same(records[i], others[i]), rule);
    }
  };
  if (study.recheck > 0) check_rechecks(index, *journal);
  if (scenario_.liar >= 0) {
    compare(folded_records(study, *journal), "the fold of the journal is another result");
    if (!ends.time_was_up && study.in_sequence) {
      observer_.require(
          without_liars(study, *journal),
          "without the liars' results the study does not come to what it is without faults");
    }
  } else if (study.in_sequence) {
    // Of its core: policies carry the names that workers have told.
    compare(faultless_records(slot.process->core().study(),
                              VirtualTask(scenario_.seed, scenario_.task), ends.num_applied),
            "the result is not that without faults");
    compare(folded_records(study, *journal), "the fold of the journal is another result");
  } else {
    compare(folded_records(study, *journal), "the fold of the journal is another result");
  }
}

/// Folds the journal without what liars have said, as treeroll-replay does, and learns the rest
/// from sound workers. @return  whether that gives what no liar has had a part in
bool Simulation::without_liars(const Study& study, const std::vector<JournalRecord>& journal) {
  const WithoutFault without_fault;
  learner::LearnerCore core(study, {.learner_id = 1, .batch_bytes_max = 1400, .known_tasks = {}});
  learner::Effects unsent;
  core.step(TimePoint{}, learner::Started{}, unsent);
  Refold refold(core, observer_.liars);
  for (const JournalRecord& record : journal) refold.read_ahead({.record = record});
  std::vector<JournalRecord> kept;
  for (const JournalRecord& record : journal) {
    for (JournalRecord& each : refold.next({.record = record}, TimePoint{})) {
      kept.push_back(std::move(each));
    }
  }
  observer_.count("results of liars left out", refold.counts().num_left_out);
  observer_.count("of these replaced by a second answer", refold.counts().num_replaced);
  observer_.count("results that followed from these", refold.counts().num_following);
  const std::vector<RunRecord> folded = folded_records(study, kept);
  const std::vector<RunRecord> left = core.run_records();
  const VirtualTask task(scenario_.seed, scenario_.task);
  const std::vector<RunRecord> faultless = faultless_records(study, task, {});
  for (std::size_t i = 0; i < left.size(); ++i) {
    const std::vector<RolloutRecord>& rollouts = left[i].rollouts;
    // What is kept is what every sound worker has said, from the first roll-out on.
    const bool is_sound =
        rollouts.size() <= faultless[i].rollouts.size() &&
        std::equal(rollouts.begin(), rollouts.end(), faultless[i].rollouts.begin(),
                   [](const auto& a, const auto& b) {
                     return a.reward == b.reward && a.layer == b.layer && a.status == b.status;
                   });
    if (!is_sound || !same(folded[i], left[i])) return false;
  }
  return true;
}

/// What the learner knows of its workers stands in its journal.
void Simulation::check_rechecks(int index, const std::vector<JournalRecord>& journal) {
  const LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  const RecheckRecord& live = slot.process->core().workforce().rechecks().record();
  learner::LearnerCore core(scenario_.studies[static_cast<std::size_t>(index)],
                            {.learner_id = 1, .batch_bytes_max = 1400, .known_tasks = {}});
  learner::Effects unsent;
  core.step(TimePoint{}, learner::Started{}, unsent);
  for (const JournalRecord& record : journal) apply({.record = record}, TimePoint{}, core);
  observer_.require(core.workforce().rechecks().record() == live,
                    "the journal tells another story of its workers");
  observer_.count("roll-outs run again", live.num_rechecked);
  observer_.count("of these disputed", live.num_disputed);
  for (const auto& [id, worker] : live.workers) {
    observer_.count("workers outvoted", worker.num_outvoted > 0 ? 1 : 0);
  }
}

}  // namespace treeroll::simulation
