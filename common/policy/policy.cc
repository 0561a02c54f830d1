#include "common/policy/policy.h"

#include <nlohmann/json.hpp>

#include "common/policy/policy_text.h"

namespace treeroll {
namespace {

constexpr double kLeastEffect = 1e-3;

}  // namespace

Eigen::VectorXd equal_steps(const PolicyEffect& effect) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(effect.derivative.cols());
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    squares += effect.derivative.row(row).transpose().cwiseAbs2();
  }
  squares /= static_cast<double>(effect.outputs.rows());
  const double least = kLeastEffect * kLeastEffect * squares.maxCoeff();
  return squares.cwiseMax(least).cwiseSqrt().cwiseInverse();
}

std::string to_json(const Policy& policy) { return to_json(policy, {}); }

std::string to_json(const Policy& policy, const SignalNames& signals) {
  nlohmann::json out = policy.content();
  out["format"] = kPolicyFormat;
  out["version"] = kPolicyVersion;
  // Policies are known by the hash of their text: those of the first kind keep the text they had
  // before there were others.
  if (policy.kind() != kDefaultPolicyKind) out["kind"] = policy.kind();
  if (!signals.empty()) {
    out["signals"] = {{"inputs", signals.inputs}, {"outputs", signals.outputs}};
  }
  return out.dump();
}

}  // namespace treeroll
