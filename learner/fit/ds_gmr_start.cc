#include "learner/fit/ds_gmr_start.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/policy/ds_gmr/ds_gmr_policy.h"
#include "common/policy/ds_gmr/spring.h"
#include "common/policy/input_range.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/linear_fit.h"
#include "learner/fit/recordings.h"
#include "learner/fit/start_policy.h"

namespace treeroll {
namespace {

/// Softer springs lag behind the swing-up's demonstration.
constexpr double kPullOtherwise = 88;
constexpr Eigen::Index kSamplesMin = 3;

double square(double number) { return number * number; }

DsGmrPolicy::Pull read_pull(SettingsReader& policy, LinearRange range) {
  const double duration = range.high - range.low;
  const DsGmrPolicy::Pull pull{
      .low = range.low,
      .high = range.high,
      .stiffness = policy.number(
          "stiffness", kPositive, square(kPullOtherwise / duration),
          {.meaning = "kp of the spring that pulls the movement along the attractor, critically "
                      "damped",
           .unit = "1/s^2",
           .otherwise = "(88 / duration)^2",
           .rule = "its root times the duration is 1 to 1e5"})};
  // Of a duration too short or too long no stiffness is a number.
  if (!DsGmrPolicy::is_pull(pull)) {
    policy.refuse("stiffness",
                  fmt::format("{}, and the movement is {:g} s", DsGmrPolicy::kPullRule, duration));
  }
  return pull;
}

/// The attractors of recordings one after the other: a new one begins where the time does not rise,
/// or leaves a gap. Over such a seam there is no acceleration.
Eigen::MatrixXd attractors(SettingsReader& policy, const Eigen::MatrixXd& data, double stiffness) {
  Eigen::MatrixXd attractors(data.rows(), data.cols());
  const double gap = kGapSteps * median_step(data.row(0));
  Eigen::Index first = 0;
  for (Eigen::Index n = 1; n <= data.cols(); ++n) {
    const double step = n == data.cols() ? 0 : data(0, n) - data(0, n - 1);
    if (step > 0 && step <= gap) continue;
    if (n - first < kSamplesMin) {
      policy.refuse("demonstration",
                    fmt::format("of this kind of policy must have {} samples in each recording, "
                                "which ends where the time does not rise or leaves a gap of more "
                                "than {} median steps: the one that begins with sample {} has {}",
                                kSamplesMin, kGapSteps, first + 1, n - first));
    }
    attractors.middleCols(first, n - first) =
        attractor_of(data.middleCols(first, n - first), stiffness);
    first = n;
  }
  for (Eigen::Index o = 1; o < data.rows(); ++o) {
    if (!attractors.row(o).array().isFinite().any() || attractors.row(o).array().isInf().any()) {
      policy.refuse("demonstration",
                    fmt::format("of this kind of policy must have an acceleration of output {}: "
                                "three samples in a row, and not too near each other in time",
                                o));
    }
  }
  // A sample that lacks them all tells nothing.
  Eigen::Index num_kept = 0;
  for (Eigen::Index n = 0; n < attractors.cols(); ++n) {
    if (attractors.col(n).tail(attractors.rows() - 1).array().isNaN().all()) continue;
    attractors.col(num_kept++) = attractors.col(n).eval();
  }
  attractors.conservativeResize(Eigen::NoChange, num_kept);
  return attractors;
}

/// What the sources have of an earlier fit, the movement taken off.
std::optional<StartPolicy> fitted_attractor(SettingsReader& policy, const StartSources& sources) {
  if (!sources.fitted) return std::nullopt;
  const auto* known = dynamic_cast<const DsGmrPolicy*>(sources.fitted->policy.get());
  if (known == nullptr) {
    policy.refuse("fit", "the study's stored start is another one: its kind differs");
  }
  StartPolicy attractor = *sources.fitted;
  attractor.policy = known->attractor();
  return attractor;
}

}  // namespace

StartPolicy read_ds_gmr_start(SettingsReader& policy, const StartSources& sources) {
  const std::optional<StartPolicy> fitted = fitted_attractor(policy, sources);
  StartSources of_attractor = sources;
  of_attractor.fitted = fitted ? &*fitted : nullptr;
  std::optional<DsGmrPolicy::Pull> pull;
  StartPolicy start = read_tree_start(policy, of_attractor, [&](Demonstration& demonstration) {
    if (demonstration.alignment == Alignment::kDynamicTimeWarping) {
      policy.refuse("demonstration.align",
                    "of this kind of policy must be \"none\" or \"duration\": dynamic time warping "
                    "makes times stand still and jump, over which there is no acceleration");
    }
    if (demonstration.input_dim != 1) {
      policy.refuse("demonstration", "of this kind of policy must have one input, the time");
    }
    const LinearRange range = range_of(demonstration);
    if (!is_input_range(range.low, range.high)) {
      policy.refuse("demonstration", std::string("the range of its input ") + kInputRangeRule);
    }
    pull = read_pull(policy, range);
    demonstration.data = attractors(policy, demonstration.data, pull->stiffness);
  });
  if (!pull) pull = read_pull(policy, read_linear_range(policy));
  if (start.policy->input_dim() != 1) {
    policy.refuse("layer_1", "of this kind of policy must have one input, the time");
  }
  start.policy = std::make_shared<DsGmrPolicy>(std::move(start.policy), *pull);
  return start;
}

}  // namespace treeroll
