#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "learner/web/views/live_study.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::web {

/// A core and what is seen of it, answered without workers: each roll-out in its turn by a reward
/// of its theta.
class FedStudy {
 public:
  using Answering = std::function<Outcome(protocol::RolloutKey, const Eigen::VectorXd& theta)>;

  explicit FedStudy(Study study, StudyFacts facts = {}) {
    learner::LearnerSettings settings;
    settings.learner_id = kLearner;
    settings.known_tasks[study.conditions[0].task_content] =
        TaskDescription{1, 1, 0, 1, 10, true, true};
    settings.on_applied = [this](const learner::Run& run, int number) {
      live->applied(run, number);
    };
    core = std::make_unique<learner::LearnerCore>(std::move(study), settings);
    live = std::make_unique<LiveStudy>(*core, std::move(facts));
    step(learner::Started{});
  }

  static constexpr protocol::LearnerId kLearner = 77;

  static Outcome by_bump(protocol::RolloutKey, const Eigen::VectorXd& theta) {
    return Outcome::ok(learner::bump({theta.data(), theta.data() + theta.size()}));
  }

  /// Answers so many roll-outs, or all.
  void answer(int count, const Answering& answering = by_bump) {
    for (; count > 0 && !core->ledger().ready().empty(); --count) {
      const protocol::RolloutKey key = core->ledger().ready().front();
      const learner::Question& question = core->ledger().find(key)->question;
      AcceptedResult result{.key = key,
                            .content = question.content,
                            .outcome = answering(key, question.theta),
                            .worker_id = 9};
      step(learner::ResultRecovered{result});
      live->accepted(result);
    }
  }

  void hear(const protocol::WorkerStatus& status) {
    step(learner::MessageReceived{status});
    live->heard(status, kLearner);
  }

  /// A second passes.
  void tick() {
    now += std::chrono::seconds(1);
    live->note(core->status(now), now);
  }

  std::unique_ptr<learner::LearnerCore> core;
  std::unique_ptr<LiveStudy> live;
  TimePoint now{std::chrono::seconds(100)};

 private:
  void step(const learner::Event& event) {
    learner::Effects effects;
    core->step(now, event, effects);
  }
};

}  // namespace treeroll::web
