#pragma once

#include <cstdint>
#include <vector>

#include "workers/tasks/task.h"

namespace treeroll {

/// A task without a plant, for tests and benchmarks: takes as long as it is told, and fails, hangs
/// or crashes for the share of policies it is told. Its reward is
///   exp(-sensitivity * mean((u(x) - line(x))^2)),
/// u(x) what the policy gives, the mean over its outputs and over some inputs x about that of the
/// target; 1 for a policy that gives the target's line. Which policies fail, hang or crash follows
/// from a hash of those outputs alone: it is the same on every worker and at every attempt.
///
/// Settings:
///   input_dim = 1, output_dim = 1
///   sensitivity = 1
///   target = [1, 1, ...]     # of the line: an input, its outputs, and its slope, row by row
///   duration_us = 0          # of each evaluation
///   mode = "burn"            # processor time, or "sleep": time on the clock
///   fail_fraction = 0        # of policies: status failed
///   hang_fraction = 0        # never answered: burns or sleeps for ever
///   crash_fraction = 0       # ends the process by SIGSEGV
///   discard_fraction = 0     # of trials, not of policies: void, drawn from the seed
///   noise_deviation = 0      # standard deviation of noise on the reward, drawn from the seed;
///                            # clamped to [0, 1]. Not zero: the task is not deterministic
///   time_limit_s = 10
class SyntheticTask : public Task {
 public:
  /// Throws ConfigError.
  explicit SyntheticTask(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;

 private:
  enum class Mode { kBurn, kSleep };
  enum class Fate { kReward, kFail, kHang, kCrash };

  Fate fate(const std::vector<double>& outputs) const;
  double reward(const std::vector<double>& outputs) const;
  /// x of every probe, one after the other.
  std::vector<double> probes() const;
  /// What the controller gives at the probes.
  std::vector<double> ask(Controller& controller) const;
  void spend(std::int64_t duration_us) const;

  int input_dim_;
  int output_dim_;
  double sensitivity_;
  std::vector<double> target_;
  std::int64_t duration_us_;
  Mode mode_;
  double fail_fraction_;
  double hang_fraction_;
  double crash_fraction_;
  double discard_fraction_;
  double noise_deviation_;
  double time_limit_s_;
};

}  // namespace treeroll
