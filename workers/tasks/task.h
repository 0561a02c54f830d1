#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/base/rollout_status.h"
#include "common/policy/gmm.h"

namespace treeroll {

class SettingsReader;

/// What a task says of itself before any roll-out.
struct TaskDescription {
  int input_dim = 0;      ///< dI of the policies it executes
  int output_dim = 0;     ///< dO
  double reward_min = 0;  ///< rewards are finite and within [reward_min, reward_max]; min >= 0
  double reward_max = 1;
  double time_limit_s = 0;    ///< CPU time after which an evaluation hangs
  bool deterministic = true;  ///< the same policy gives the same reward, whatever the seed
};

/// Outcome of one roll-out. A status other than kOk has reward 0.
struct Evaluation {
  double reward = 0;
  RolloutStatus status = RolloutStatus::kOk;
};

/// A task: plant + policy -> reward. One instance lives in each evaluator process and is asked
/// again and again, from one thread.
class Task {
 public:
  virtual ~Task() = default;
  virtual TaskDescription description() const = 0;
  /// @param policy  mixture with the dimensions of the description
  /// @param seed    for tasks that are not deterministic
  virtual Evaluation evaluate(const Gmm& policy, std::uint64_t seed) = 0;
};

/// Makes a task from its settings, read strictly: throws ConfigError on bad ones.
using TaskFactory = std::function<std::unique_ptr<Task>(SettingsReader& settings)>;

/// The tasks a worker executable knows, by name.
class TaskRegistry {
 public:
  /// Precondition: the name is new.
  void add(std::string name, TaskFactory factory);

  /// Throws ConfigError for an unknown name (with the known ones) and for bad settings.
  /// @param resolved  receives the settings with their defaults
  std::unique_ptr<Task> make(const std::string& name, const nlohmann::json& settings,
                             nlohmann::json& resolved) const;

 private:
  std::map<std::string, TaskFactory> factories_;
};

/// Registers swing_up and synthetic.
void add_standard_tasks(TaskRegistry& registry);

/// A description as JSON, and back (for the learner, which knows no task).
nlohmann::json to_json(const TaskDescription& description);

}  // namespace treeroll
