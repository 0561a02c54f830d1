#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/benchmarks/peer_options.h"
#include "tests/benchmarks/peer_rollouts.h"

namespace treeroll::benchmarks {

/// A master's connections to its workers, numbered from 0.
class PeerLinks {
 public:
  virtual ~PeerLinks() = default;
  /// No request at all tells the worker to end.
  virtual void send(int worker, std::span<const PeerRequest> requests) = 0;
  struct Received {
    int worker = 0;
    std::span<const PeerResult> results;  ///< until the next call
  };
  /// Waits for the next message of any worker.
  virtual Received receive() = 0;
};

/// A worker's connection to its master.
class PeerLink {
 public:
  virtual ~PeerLink() = default;
  /// Waits for it; empty: to end. Valid until the next call.
  virtual std::span<const PeerRequest> receive() = 0;
  virtual void send(std::span<const PeerResult> results) = 0;
};

/// What a peer has been measured to do.
struct PeerMeasurement {
  std::int64_t results = 0;  ///< within measured_s
  double measured_s = 0;
  std::int64_t results_in_all = 0;  ///< with those of the warm-up
  double master_cpu_s = 0;          ///< for all of these
  double workers_cpu_s = 0;         ///< the same
};
/// One line of JSON.
std::string to_json(const PeerMeasurement& measurement);

/// Keeps all workers busy for the given time, then lets them finish and end. Every answer is to be
/// one of a roll-out that was asked for, once, and of a sound reward: throws std::runtime_error.
PeerMeasurement run_master(PeerLinks& links, const PeerRollouts& rollouts,
                           const PeerOptions& options);

/// Executes what it is sent until it is told to end.
void run_peer_worker(PeerLink& link, PeerRollouts& rollouts);

/// Roll-outs of a process that has no master.
struct LoneCount {
  std::int64_t measured = 0;  ///< that ended within the measured time
  std::int64_t in_all = 0;
};
/// No messaging at all: executes until the end of the measured time.
LoneCount run_alone(PeerRollouts& rollouts, std::chrono::steady_clock::time_point from,
                    std::chrono::steady_clock::time_point to);

/// Processor time of this process, or of the children it has waited for.
double processor_s(int who);

}  // namespace treeroll::benchmarks
