#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "learner/core/learner_core.h"
#include "learner/core/pace.h"
#include "learner/web/views/reward_curves.h"

namespace treeroll::web {

/// What a page is told once.
struct StudyFacts {
  std::string program;  ///< version
  std::string host_name;
  std::string incarnation;  ///< of who serves the page: a page that finds another begins anew
  std::string directory;    ///< of the study's state
  bool is_replay = false;   ///< a journal is read, nobody learns here
  /// By condition, as LoadedStudy has them.
  std::vector<std::vector<std::string>> columns = {};
  std::vector<std::shared_ptr<const Eigen::MatrixXd>> demonstrations = {};
};

/// A worker as it speaks of itself, and what came from it.
struct SeenWorker {
  std::string host;
  std::int32_t pid = 0;
  std::optional<protocol::WorkerStatus> status;  ///< its last heartbeat, without what it holds
  std::int64_t num_held = 0;                     ///< for this learner, by that heartbeat
  std::int64_t num_accepted = 0;
  std::int64_t num_failed = 0;
  std::string last_failure;
  double rate_per_s = 0;
  std::int64_t num_at_mark = 0;
};

/// A failed roll-out, or a trial that was void.
struct SeenFailure {
  std::int64_t count = 0;  ///< 1 for the first of all
  AcceptedResult result;
};

/// A study for people who watch, beside the core that learns it: fed with what the journal is fed
/// with, with heartbeats and with the learner's status. Pure; what it keeps is bounded, whatever
/// comes. Views are JSON (views.h).
class LiveStudy {
 public:
  static constexpr std::size_t kFailuresMax = 200;
  static constexpr std::size_t kReasonsMax = 100;
  static constexpr std::size_t kRecentMax = 1000;
  static constexpr std::size_t kWorkersMax = protocol::kWorkersMax;  ///< all of the core's at least

  /// Precondition: the core outlives it, and has applied nothing yet.
  LiveStudy(const learner::LearnerCore& core, StudyFacts facts);

  // What happens.

  /// LearnerSettings::on_applied.
  void applied(const learner::Run& run, int number);
  /// To the journal, or out of it.
  void accepted(const AcceptedResult& result);
  void accepted(const KnownWorker& worker);
  /// From the bus.
  void heard(const protocol::WorkerStatus& status, protocol::LearnerId learner);
  /// The learner's own, once a second.
  void note(const protocol::LearnerStatus& status, TimePoint now);

  // What is known.

  const learner::LearnerCore& core() const { return core_; }
  const StudyFacts& facts() const { return facts_; }
  std::vector<RewardCurves>& curves() { return curves_; }
  const std::optional<protocol::LearnerStatus>& status() const { return status_; }
  std::optional<double> rollouts_per_s() const { return pace_.per_s(); }
  /// Roll-outs a second, a number a second.
  const std::deque<double>& rates() const { return rates_; }
  const std::map<protocol::WorkerId, SeenWorker>& workers() const { return workers_; }
  const std::deque<SeenFailure>& failures() const { return failures_; }
  std::int64_t num_failures() const { return num_failures_; }
  /// How many roll-outs failed for which reason; "" for those past kReasonsMax.
  const std::map<std::string, std::int64_t>& reasons() const { return reasons_; }
  /// The last applied ones, newest last.
  const std::deque<protocol::RolloutKey>& recent() const { return recent_; }
  /// Grows with everything that is told.
  std::int64_t version() const { return version_; }

 private:
  SeenWorker* worker(protocol::WorkerId id);
  void make_room();

  const learner::LearnerCore& core_;
  StudyFacts facts_;
  std::vector<RewardCurves> curves_;  ///< by condition
  std::optional<protocol::LearnerStatus> status_;
  learner::Pace pace_;
  std::deque<double> rates_;
  std::optional<TimePoint> marked_at_;
  std::int64_t done_at_mark_ = 0;
  std::map<protocol::WorkerId, SeenWorker> workers_;
  std::deque<SeenFailure> failures_;
  std::int64_t num_failures_ = 0;
  std::map<std::string, std::int64_t> reasons_;
  std::deque<protocol::RolloutKey> recent_;
  std::int64_t version_ = 0;
};

}  // namespace treeroll::web
