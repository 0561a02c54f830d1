#include "workers/check_evaluator/sample_policy.h"

#include <nlohmann/json.hpp>

#include "common/base/check.h"
#include "common/policy/kinds/standard_policies.h"

namespace treeroll::worker {

using nlohmann::json;

PolicyPtr sample_policy(int input_dim, int output_dim, int num_gaussians, double slope) {
  const int dim = input_dim + output_dim;
  json covariance = json::array();
  for (int row = 0; row < dim; ++row) {
    for (int column = 0; column <= row; ++column) covariance.push_back(row == column ? 1 : 0);
  }
  json gaussians = json::array();
  for (int k = 0; k < num_gaussians; ++k) {
    const double place = num_gaussians > 1 ? 2. * k / (num_gaussians - 1) : 1.;
    std::vector<double> mean(static_cast<std::size_t>(dim), 0.);
    mean.front() = place;
    for (int i = input_dim; i < dim; ++i) mean[static_cast<std::size_t>(i)] = slope * place;
    gaussians.push_back({{"parent", -1},
                         {"prior", 1. / num_gaussians},
                         {"mean", mean},
                         {"covariance", covariance}});
  }
  const json text{{"format", kPolicyFormat}, {"version", kPolicyVersion}, {"kind", "tree"},
                  {"frames", "cholesky"},    {"input_dim", input_dim},    {"layer", 1},
                  {"layout", "means"},       {"layers", {gaussians}}};
  const Result<PolicyPtr> policy = standard_policies().from_json(text.dump());
  CHECK(policy, policy.error().message);
  return *policy;
}

}  // namespace treeroll::worker
