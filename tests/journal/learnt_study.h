#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/files/whole_file.h"
#include "learner/core/run.h"
#include "learner/journal/journal_file.h"
#include "learner/results/csv.h"
#include "learner/study/study_file.h"

namespace treeroll::study_test {

/// Two conditions over a tree of two layers, two repetitions of so many roll-outs.
/// @param order  and further settings of [study]
inline std::string tree_study(const std::string& order, int rollouts = 12) {
  return R"([study]
name = "mine"
repetitions = 2
rollouts = )" +
         std::to_string(rollouts) + "\n" + order +
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

/// The same with a third layer, and roll-outs enough to reach it.
inline std::string deep_study(const std::string& order) {
  std::string text = tree_study(order, 160);
  return text.insert(text.find("[exploration]"), R"([policy.layer_3]
range = [0.0, 2.0]
outputs = [0.0, 0.0, 0.0, 0.0]
deviations = [0.125, 0.3]
parents = [1, 1, 2, 2]
)");
}

/// What learning came to, noted as it went.
struct LearntStudy {
  std::map<std::string, std::vector<std::vector<double>>> noise;  ///< by condition, repetition
  std::vector<RunRecord> runs;
  int num_switches = 0;
};

struct Arrival {
  /// Results come one by one in an order drawn from it; without it each batch of draws is answered
  /// in reverse before the next is asked for.
  std::optional<unsigned> seed = std::nullopt;
  /// Of each run, before the time of a study that has stop_after_s is up.
  std::size_t results_before_stop = std::numeric_limits<std::size_t>::max();
};

/// One run on its way.
struct RunUnderWay {
  learner::Run run;
  std::vector<explore::Draw> asked = {};
  std::size_t num_told = 0;
  std::vector<double> noise = {};  ///< after each result applied; NaN where the next came with it
};

/// Tells a run results until it has had so many, or wants none.
inline void learn(RunUnderWay& learning, std::size_t results, const Arrival& arrival,
                  std::mt19937& order, JournalWriter& journal) {
  learner::Run& run = learning.run;
  while (learning.num_told < results) {
    if (arrival.seed || learning.asked.empty()) {
      for (explore::Draw& draw : run.take_draws()) learning.asked.push_back(std::move(draw));
    }
    if (learning.asked.empty()) return;
    const std::size_t place =
        (arrival.seed ? order() : std::size_t{learning.asked.size() - 1}) % learning.asked.size();
    const explore::Draw draw = learning.asked[place];
    learning.asked.erase(learning.asked.begin() + static_cast<std::ptrdiff_t>(place));
    // Rewards fall as the run goes on, so that layers converge.
    const double reward =
        .5 / (std::max(draw.rollout, -1) + 2) * std::exp(-draw.theta.squaredNorm());
    const int applied = run.accept(draw.rollout, Outcome::ok(reward), 0);
    if (draw.rollout >= 0) ++learning.num_told;
    AcceptedResult result;
    result.key = {.run = run.index(), .number = draw.rollout};
    result.outcome = Outcome::ok(reward);
    journal.append(result, 0);
    // Deviations .2 and .5 of time and output.
    const Eigen::VectorXd variances = run.exploration().noise().diagonal();
    double sum = 0;
    for (Eigen::Index i = 0; i < variances.size(); ++i) {
      sum += variances[i] / (i % 2 == 0 ? .04 : .25);
    }
    if (applied == 0) continue;
    learning.noise.resize(learning.noise.size() + static_cast<std::size_t>(applied),
                          std::numeric_limits<double>::quiet_NaN());
    learning.noise.back() = std::sqrt(sum / static_cast<double>(variances.size()));
  }
}

/// Learns a study without a worker and leaves its state directory: study, journal, results.
inline LearntStudy learn_into(const std::filesystem::path& directory, const std::string& text,
                              const Arrival& arrival = {}) {
  std::filesystem::create_directories(directory / "policies");
  std::ofstream(directory / "study.toml") << text;
  const Study study = load_study(directory / "study.toml", {}).study;
  JournalWriter journal(directory / "journal.lcmlog");
  journal.append(JournalStart{.study_id = content_hash(text)}, 0);
  std::mt19937 order(arrival.seed.value_or(0));
  std::vector<RunUnderWay> learning;
  for (int index = 0; index < study.num_runs(); ++index)
    learning.push_back({learner::Run(study, index)});
  for (RunUnderWay& run : learning) {
    learn(run, arrival.results_before_stop, arrival, order, journal);
  }
  if (study.stop_after) {
    journal.append(LearningTime{*study.stop_after / 2}, 0);
    journal.append(LearningTime{*study.stop_after}, 0);
    for (RunUnderWay& run : learning) run.run.stop();
    for (RunUnderWay& run : learning) {
      learn(run, std::numeric_limits<std::size_t>::max(), arrival, order, journal);
    }
  }
  LearntStudy learnt;
  for (const RunUnderWay& run : learning) {
    learnt.runs.push_back(run.run.record());
    const RunRecord& record = learnt.runs.back();
    std::ofstream(directory / "policies" /
                  (record.condition + "-" + std::to_string(record.repetition) + ".json"))
        << record.best_policy;
    learnt.noise[record.condition].push_back(run.noise);
    learnt.num_switches += static_cast<int>(record.switches.size());
  }
  journal.append(JournalSeal{}, 0);
  journal.flush();
  write_runs_csv(directory / "runs.csv", learnt.runs);
  write_rollouts_csv(directory / "rollouts.csv", learnt.runs);
  return learnt;
}

}  // namespace treeroll::study_test
