#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/start_policy.h"

namespace treeroll {

/// What a study begins with whose [policy] table is this, as JSON.
/// @param resolved_out  takes the table with all that was left open; may be null
inline StartPolicy read_start(const std::string& text, const StartSources& sources = {},
                              nlohmann::json* resolved_out = nullptr) {
  const nlohmann::json table = nlohmann::json::parse(text);
  nlohmann::json resolved;
  SettingsReader reader(table, "policy", resolved);
  StartPolicy policy = learnable_policies().read_start(reader, sources);
  reader.finish();
  if (resolved_out != nullptr) *resolved_out = resolved;
  return policy;
}

/// "accepted" if it is not refused.
inline std::string refusal_of(const std::string& text, const StartSources& sources = {}) {
  try {
    read_start(text, sources);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

/// Root mean square of what a policy with one input and output gives beside data of two rows.
inline double rms_error(const Policy& policy, const Eigen::MatrixXd& data) {
  const auto controller = policy.controller();
  double sum = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    const double error = controller->act(data(0, n)) - data(1, n);
    sum += error * error / static_cast<double>(data.cols());
  }
  return std::sqrt(sum);
}

}  // namespace treeroll
