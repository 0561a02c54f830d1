#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "learner/app/study_file.h"
#include "learner/core/run.h"
#include "learner/journal/journal_file.h"
#include "learner/report/csv.h"
#include "learner/report/whole_file.h"

namespace treeroll::study_test {

/// Two conditions over a tree of two layers, two repetitions of twelve roll-outs.
/// @param order  and further settings of [study]
inline std::string tree_study(const std::string& order) {
  return R"([study]
name = "mine"
repetitions = 2
rollouts = 12
)" + order +
         R"(
[task]
name = "anything"
[policy]
start = "components"
layout = "means"
[policy.layer_1]
range = [0.0, 2.0]
outputs = [0.0]
deviations = [0.5, 0.3]
[policy.layer_2]
range = [0.0, 2.0]
outputs = [0.0, 0.0]
deviations = [0.25, 0.3]
parents = [1, 1]
[exploration]
noise_variance = [0.04, 0.25]
first_update = 2
best_considered = 2
convergence_window = 4
[[conditions]]
name = "tree"
[[conditions]]
name = "flat"
policy.model = "flat"
)";
}

/// What learning came to, noted as it went.
struct LearntStudy {
  std::map<std::string, std::vector<std::vector<double>>> noise;  ///< by condition, repetition
  int num_switches = 0;
};

/// Learns a study without a worker, results in reverse order of each batch of draws, and leaves its
/// state directory: study, journal, results.
inline LearntStudy learn_into(const std::filesystem::path& directory, const std::string& text) {
  std::filesystem::create_directories(directory / "policies");
  std::ofstream(directory / "study.toml") << text;
  const Study study = load_study(directory / "study.toml", {}).study;
  JournalWriter journal(directory / "journal.lcmlog");
  journal.append(JournalStart{}, 0);
  LearntStudy learnt;
  std::vector<RunRecord> records;
  for (int index = 0; index < study.num_runs(); ++index) {
    Run run(study, index);
    std::vector<double> noise;
    for (auto wanted = run.take_wanted(); !wanted.empty(); wanted = run.take_wanted()) {
      for (auto asked = wanted.rbegin(); asked != wanted.rend(); ++asked) {
        // Rewards fall as the run goes on, so that layers converge.
        const double reward = .5 / (asked->number + 2) * std::exp(-asked->theta.squaredNorm());
        const int applied = run.accept(asked->number, reward, RolloutStatus::kOk, 0);
        AcceptedResult result;
        result.key = {.run = index, .number = asked->number};
        result.reward = reward;
        journal.append(result, 0);
        // Deviations .2 and .5 of time and output.
        const Eigen::VectorXd variances = run.exploration().noise().diagonal();
        double sum = 0;
        for (Eigen::Index i = 0; i < variances.size(); ++i) {
          sum += variances[i] / (i % 2 == 0 ? .04 : .25);
        }
        if (applied == 1) noise.push_back(std::sqrt(sum / static_cast<double>(variances.size())));
      }
    }
    records.push_back(run.record());
    const RunRecord& record = records.back();
    std::ofstream(directory / "policies" /
                  (record.condition + "-" + std::to_string(record.repetition) + ".json"))
        << record.best_policy;
    learnt.noise[record.condition].push_back(noise);
    learnt.num_switches += static_cast<int>(record.switches.size());
  }
  journal.flush();
  write_runs_csv(directory / "runs.csv", records);
  write_rollouts_csv(directory / "rollouts.csv", records);
  return learnt;
}

}  // namespace treeroll::study_test
