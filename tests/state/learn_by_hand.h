#pragma once

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/files/atomic_file.h"
#include "learner/results/state_directory.h"
#include "learner/state/state_study.h"

namespace treeroll::state_test {

/// A learner without workers: it answers what its core asks, in an order of its own.
class HandLearner {
 public:
  /// Begins a study in a new directory, or goes on with that of `directory`.
  HandLearner(const std::filesystem::path& directory, const std::string& new_study,
              const std::vector<std::string>& extension = {})
      : files_{directory, journal_of(directory)} {
    if (!new_study.empty()) {
      std::filesystem::create_directories(directory);
      write_atomically(study_of(directory), new_study);
      const std::string resolved = load_study(study_of(directory), {}).resolved.to_toml("");
      write_atomically(study_of(directory), resolved);
    }
    journal_ = std::make_unique<JournalWriter>(files_.journal);
    state_ = read_state_study(files_, extension);
    core_ = std::make_unique<learner::LearnerCore>(state_.loaded.study, learner::LearnerSettings{});
    journal_->continue_after(fold_state(files_, state_, TimePoint{}, *core_));
    journal_->append(JournalStart{.study_id = state_.in_journal.id, .learner_id = 1}, 0);
  }

  /// The record of an extension, if there is one. A learner that is killed may not come so far.
  void begin(bool writes_record = true) {
    if (!state_.in_journal.is_before_extension) return;
    const JournalExtension extension = write_extension(files_, state_, "");
    if (writes_record) journal_->append(extension, 0);
    journal_->flush();
  }

  /// @param seed  the order of the answers follows from it
  void learn(unsigned seed, int results = std::numeric_limits<int>::max()) {
    std::mt19937 order(seed);
    for (int i = 0; i < results && !done(); ++i) {
      const auto& ready = core_->ledger().ready();
      const protocol::RolloutKey key = ready[order() % ready.size()];
      const learner::Question& question = core_->ledger().find(key)->question;
      const double reward = std::exp(-.1 * question.theta.squaredNorm());
      // One in seven fails.
      const Outcome outcome =
          key.number % 7 == 3 ? Outcome::failed(RolloutStatus::kDiverged) : Outcome::ok(reward);
      const AcceptedResult result{key, question.content, outcome, 5, 1'000'000};
      learner::Effects unsent;
      core_->step(TimePoint{}, learner::ResultRecovered{result}, unsent);
      journal_->append(result, 0);
    }
  }
  void pass(Duration learnt) {
    learner::Effects unsent;
    core_->step(TimePoint{}, learner::TimeRecovered{{learnt}}, unsent);
    journal_->append(LearningTime{learnt}, 0);
  }
  void end() {
    journal_->append(JournalSeal{}, 0);
    journal_->flush();
    journal_.reset();
  }
  void flush() { journal_->flush(); }

  bool done() const { return core_->outcome() == learner::LearnerCore::Outcome::kDone; }
  const learner::LearnerCore& core() const { return *core_; }
  const StateStudy& state() const { return state_; }

 private:
  StateFiles files_;
  std::unique_ptr<JournalWriter> journal_;
  StateStudy state_;
  std::unique_ptr<learner::LearnerCore> core_;
};

}  // namespace treeroll::state_test
