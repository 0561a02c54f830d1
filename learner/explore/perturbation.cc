#include "learner/explore/perturbation.h"

#include <Eigen/Cholesky>

#include "common/base/check.h"

namespace treeroll::explore {

Eigen::MatrixXd noise_factor(const Eigen::MatrixXd& noise) {
  CHECK(noise.allFinite() && (noise.diagonal().array() > 0).all(),
        "exploration noise must be finite with variances above 0");
  Eigen::LLT<Eigen::MatrixXd> factorised(noise);
  for (double raise = 1e-14; factorised.info() != Eigen::Success; raise *= 10) {
    CHECK(raise < 1e-3, "exploration noise is not positive semi-definite");
    Eigen::MatrixXd raised = noise;
    raised.diagonal() *= 1 + raise;
    factorised.compute(raised);
  }
  return factorised.matrixL();
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
