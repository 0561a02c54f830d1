#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/policy/policy.h"
#include "learner/explore/metric.h"
#include "learner/explore/power_rule.h"
#include "learner/explore/rule_settings.h"
#include "learner/explore/standard_update_rules.h"

namespace treeroll::explore {

/// Deviation of the output in the first steps from nothing, as a share of its size.
inline constexpr double kStepFromNothing = .1;

/// Settings of one run's search: thesis table 3-2. The defaults are those of table 4-3.
struct ExplorationSettings {
  int num_rollouts = 200;               ///< N, the budget
  int in_flight = 1;                    ///< draws ahead of applied results
  RuleSettings rule = PowerSettings{};  ///< how the search distribution follows from results
  int convergence_window = 20;          ///< M
  double convergence_slope = 0;         ///< eps_conv, reward per roll-out
  /// Share of the layer's average gain a roll-out below which the gain of the last M counts as
  /// convergence; without it the slope decides.
  std::optional<double> convergence_gain;
  std::optional<double> stop_at_reward;  ///< the run ends with the first reward of at least this
  bool stop_on_convergence = false;      ///< the run ends when the last layer has converged
  std::vector<double> noise_variance;    ///< Policy::noise_variance_dim() numbers: Sigma_noise
  double initial_noise_factor = 1;       ///< gamma: initial noise = gamma * noise_variance
  /// In place of those two: deviation of the initial noise, in units of the output, in the steps of
  /// `metric`; without one, in Policy::steps_of_equal_effect().
  std::optional<double> initial_step;
  std::optional<Metric> metric;
  double output_scale = 0;  ///< size of the output, above 0 with `metric`
  double bold_step = 0;     ///< as initial_step: for a start that is far from good
  /// Of all bold steps: initial_step as a share of its default, at most 1.
  double boldness = 1;
  /// Nobody has told the size of the output, and the start does nothing: the rule tries some.
  bool tries_scale = false;
  bool reuse = true;    ///< the next layer begins with the experience of the one left
  int first_layer = 1;  ///< explored first
  int last_layer = 1;   ///< explored to the end of the budget
  bool operator==(const ExplorationSettings&) const = default;
};

/// Whether what a layer's start costs is bounded. A study that has begun has had its starts, and is
/// read whatever they cost.
enum class StartWork { kBounded, kAny };

/// Reads the [exploration] table of a study for a given start policy (number of layers and of noise
/// variances). `num_rollouts` and `in_flight` are the study's and stay untouched.
/// Where there is no `noise_variance`, the noise follows from what theta does to the output, and
/// from the size of the output: that of the start policy, or `output_scale`, required for a start
/// that does nothing, but by a rule that tries some. `last_layer` is the policy's last by default,
/// the rest as in ExplorationSettings. A study that names no rule has "auto"; with noise_variance
/// it has "power", as when there was no other way. Throws ConfigError. Does not call finish(): the
/// caller does.
/// @param rules  that a study may name
ExplorationSettings read_exploration_settings(
    SettingsReader& exploration, const Policy& start,
    std::span<const UpdateRuleKind> rules = standard_update_rules(),
    StartWork work = StartWork::kBounded);

}  // namespace treeroll::explore
