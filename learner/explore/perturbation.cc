#include "learner/explore/perturbation.h"

#include <Eigen/Cholesky>
#include <utility>

#include "common/base/check.h"

namespace treeroll::explore {

std::optional<Eigen::MatrixXd> noise_factor_if_any(const Eigen::MatrixXd& noise) {
  if (!noise.allFinite() || !(noise.diagonal().array() > 0).all()) return std::nullopt;
  Eigen::LLT<Eigen::MatrixXd> factorised(noise);
  for (double raise = 1e-14; factorised.info() != Eigen::Success; raise *= 10) {
    if (raise >= 1e-3) return std::nullopt;
    Eigen::MatrixXd raised = noise;
    raised.diagonal() *= 1 + raise;
    factorised.compute(raised);
  }
  return factorised.matrixL();
}

Eigen::MatrixXd noise_factor(const Eigen::MatrixXd& noise) {
  std::optional<Eigen::MatrixXd> factor = noise_factor_if_any(noise);
  CHECK(factor.has_value(),
        "exploration noise is not positive semi-definite and finite with variances above 0");
  return *std::move(factor);
}

Eigen::VectorXd normal_numbers(Eigen::Index n, RandomStream stream) {
  Eigen::VectorXd normal(n);
  for (double& element : normal) element = stream.next_normal();
  return normal;
}

Eigen::VectorXd perturb(const Eigen::VectorXd& mean, const Eigen::MatrixXd& factor,
                        const Eigen::VectorXd& normal) {
  return mean + factor.triangularView<Eigen::Lower>() * normal;
}

}  // namespace treeroll::explore
