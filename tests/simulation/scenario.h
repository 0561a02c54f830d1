#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "learner/core/study.h"
#include "tests/simulation/virtual_task.h"

namespace treeroll::simulation {

/// What may befall a message from one process to another.
struct NetworkFaults {
  double loss = 0;
  double duplication = 0;
  double truncation = 0;
  Duration delay_min{};
  Duration delay_max{};
  double straggling = 0;  ///< this share takes up to kStragglerDelay
  bool reorders = false;  ///< else a link keeps the order
};
/// A threshold above any slope: a layer is left as soon as it has results enough.
inline constexpr double kAnySlope = 100;
inline constexpr Duration kStragglerDelay = std::chrono::milliseconds(300);

/// Something that befalls one worker slot, or the learner, at a time.
struct Incident {
  enum class Kind {
    kWorkerCrash,       ///< SIGKILL of the daemon: all it knew is gone; back after `length`
    kWorkerDrain,       ///< SIGTERM; once gone it is back after `length`
    kWorkerStop,        ///< SIGSTOP for `length`
    kPartition,         ///< the worker and the learner do not hear each other for `length`
    kEvaluatorsKilled,  ///< SIGKILL of every evaluator of the worker
    kEvaluatorsDying,   ///< the same, and of each new one at its start or its work, for `length`
    kWorkerDeaf,        ///< from then on nothing reaches the worker, nor its successors
    kEvaluatorsStuck,   ///< from then on no roll-out at the worker ends, nor at its successors
    kPlayback,          ///< all that was said until then is said again, and again
    kRelayCrash,        ///< SIGKILL of a relay; back after `length`
    kRelayDrain,        ///< SIGTERM of a relay; once gone it is back after `length`
    kRelayStop,         ///< SIGSTOP of a relay for `length`
    kLearnerDies,       ///< SIGKILL, and it does not come back
    kLearnerCrash,      ///< at its next effect; back after `length` from its journal
    kLearnerExit,       ///< SIGTERM; once gone it is back after `length`
    kLearnerStop,       ///< SIGSTOP for `length`
  };
  Kind kind = Kind::kWorkerCrash;
  TimePoint time;
  Duration length{};
  int slot = 0;      ///< of the worker, the relay or the learner
  double speed = 1;  ///< of a playback

  bool befalls_relay() const { return kind >= Kind::kRelayCrash && kind < Kind::kLearnerDies; }
  bool befalls_learner() const { return kind >= Kind::kLearnerDies; }
};

struct WorkerPlan {
  TimePoint joins;
  int num_evaluators = 1;
  int relay = -1;  ///< below which it is; -1: beside the learners
};

/// All that a seed means. Faults of the network and incidents end at `faults_end`, but for those
/// that say that they do not.
struct Scenario {
  std::uint64_t seed = 0;
  std::vector<Study> studies;  ///< one a learner, all on one group with the same workers
  bool knows_task = true;      ///< else the first worker's description decides
  std::size_t batch_bytes_max = 60000;
  TaskBehaviour task;
  NetworkFaults network;
  std::vector<WorkerPlan> workers;
  int workers_per_host = 1;
  int num_relays = 0;
  bool has_keys = false;      ///< a learner's for learners, a key of its own for each worker
  double stranger_share = 0;  ///< of messages that a stranger answers
  int liar = -1;           ///< slot of a worker that answers what is not so, now and then; -1: none
  double lying_share = 0;  ///< of its answers
  std::vector<Incident> incidents;
  Duration reading_delay{};  ///< from a message's arrival to the process that reads it
  std::int64_t unsynced_results_max = protocol::kUnsyncedResultsMax;
  Duration sync_delay{};  ///< from the journal's write to its fdatasync, and until that is done
  Duration load_time{};   ///< of a definition into an evaluator
  TimePoint faults_end;
};

/// A study whose runs switch layers, workers and a task without faults, all small; in both orders,
/// one to four in flight.
Scenario calm_scenario(std::uint64_t seed);
/// The same with a mix of faults; one time in four with a second learner, one in four with studies
/// that are learnt for a time, and one in seven with a fault that lasts.
Scenario scenario_of(std::uint64_t seed);

/// The scenario with one or two relays, most workers below them, and what may befall a relay.
Scenario with_relays(Scenario scenario);

/// The same among keys and strangers.
Scenario with_keys(Scenario scenario);

/// The same where a share of the roll-outs is run again on another worker.
Scenario with_rechecks(Scenario scenario);
/// The same with one worker of three or more that lies now and then.
Scenario with_liar(Scenario scenario);

/// A tree of two layers of so many Gaussians.
PolicyPtr wide_policy(int num_first, int num_last);

/// Of keys: workers have their slots'.
inline constexpr int kHostOfRelays = 500;
inline constexpr int kInsidersHost = 900;

int num_rollouts(const Scenario& scenario);
int num_rollouts(const Study& study);
int num_runs(const Scenario& scenario);
int num_in_flight(const Study& study);
const Condition& condition_of(const Study& study, int run);

}  // namespace treeroll::simulation
