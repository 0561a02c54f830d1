#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

class SettingsReader;

/// What a policy must never do, whoever executes it. They bound the policy: what a task adds to its
/// outputs they do not see. Empty lists bound nothing.
struct PolicyBounds {
  bool refuses = false;  ///< what is beyond them; else it is clipped
  /// Of theta in the layer that is explored: one number for each of Policy::noise_variance_dim(),
  /// or one for all.
  std::vector<double> theta_min = {};
  std::vector<double> theta_max = {};
  /// Of each output, in its unit: dO numbers, or one for all.
  std::vector<double> output_min = {};
  std::vector<double> output_max = {};
  /// Of each output, in its unit per s, from one asking to the next, sample_time_s later.
  std::vector<double> output_rate_max = {};
  double sample_time_s = 0;
  /// What stands at the output before the first asking of a roll-out; empty: the first may be any.
  std::vector<double> output_start = {};
};

/// Reads the table [policy.bounds] of a study for this policy. Throws ConfigError, also for a start
/// policy whose theta is beyond the bounds in one of its layers. Calls finish().
PolicyBounds read_policy_bounds(SettingsReader table, const PolicyPtr& policy);

/// The policy within bounds: with() and what its controllers give obey them. In all else it is the
/// policy itself. Beyond bounds that refuse, with() throws std::invalid_argument as for any theta
/// that makes no policy, as does controller() of a policy whose own theta is beyond them, and act()
/// throws std::runtime_error: the roll-out ends there and has failed, and nothing beyond the bounds
/// has been given out.
PolicyPtr bounded(PolicyPtr policy, PolicyBounds bounds);

/// The policy without its bounds.
PolicyPtr without_bounds(const PolicyPtr& policy);

/// Lets the rate of a bounded policy's outputs hold on when a controller takes the place of another
/// in the midst of a roll-out. Nothing where one of them has no bounds.
void go_on_from(const Controller& before, Controller& controller);

/// How far apart its bounds take the askings of a policy to be, in s; 0 for one whose outputs may
/// change at any rate.
double sample_time_s(const Policy& policy);

/// As Policy::content() of a bounded policy holds them under the key "bounds". Throws
/// PolicyTextError.
PolicyBounds bounds_from_content(const PolicyText& content, const Policy& policy);

}  // namespace treeroll
