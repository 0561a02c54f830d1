#include "common/policy/tree/theta_layout.h"

#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

bool has_psi(ThetaLayout layout) { return layout != ThetaLayout::kMeans; }

bool is_pourahmadi(ThetaLayout layout) {
  return layout == ThetaLayout::kMeansPourahmadi || layout == ThetaLayout::kReducedPourahmadi;
}

/// First element of the mean that is explored: the reduced layouts leave those of the inputs alone.
int first_mean(ThetaLayout layout, int input_dim) {
  const bool is_reduced =
      layout == ThetaLayout::kReducedCholesky || layout == ThetaLayout::kReducedPourahmadi;
  return is_reduced ? input_dim : 0;
}

/// The blocks of a Cholesky factor.
struct Factor {
  Eigen::MatrixXd ii, oi, oo;

  Factor(const Eigen::MatrixXd& covariance, int input_dim) {
    const Eigen::MatrixXd factor = cholesky_factor(covariance);
    const Eigen::Index output_dim = factor.rows() - input_dim;
    ii = factor.topLeftCorner(input_dim, input_dim);
    oi = factor.bottomLeftCorner(output_dim, input_dim);
    oo = factor.bottomRightCorner(output_dim, output_dim);
  }

  /// The block of T^-1 = L D^-1/2 of the outputs: lower, with a unit diagonal.
  Eigen::MatrixXd unit_oo() const {
    Eigen::MatrixXd unit = oo;
    for (Eigen::Index column = 0; column < unit.cols(); ++column) {
      unit.col(column) /= oo(column, column);
    }
    return unit;
  }
};

/// S_OI S_II^-1 = L_OI L_II^-1.
Eigen::MatrixXd slope(const Factor& factor) {
  const Eigen::MatrixXd transposed = factor.oi.transpose();
  return factor.ii.transpose().triangularView<Eigen::Upper>().solve(transposed).transpose();
}

/// From T S T^T = D follows T_OI = -T_OO S_OI S_II^-1, so psi = T_OO slope.
Eigen::MatrixXd pourahmadi_psi(const Factor& factor) {
  const Eigen::MatrixXd a = slope(factor);
  return factor.unit_oo().triangularView<Eigen::UnitLower>().solve(a);
}

/// Writes S_OI and S_OO; S_II stays to the bit.
void set_psi(ThetaLayout layout, const Eigen::MatrixXd& psi, int input_dim,
             Eigen::MatrixXd& covariance) {
  const Factor factor(covariance, input_dim);
  const Eigen::Index output_dim = psi.rows();
  // S = L L^T (3-12) block by block: L_OI is psi, or what gives the slope that psi stands for.
  const Eigen::MatrixXd l_oi =
      is_pourahmadi(layout) ? Eigen::MatrixXd(factor.unit_oo() * psi * factor.ii) : psi;
  const Eigen::MatrixXd s_oi = l_oi * factor.ii.transpose();
  covariance.bottomLeftCorner(output_dim, input_dim) = s_oi;
  covariance.topRightCorner(input_dim, output_dim) = s_oi.transpose();
  covariance.bottomRightCorner(output_dim, output_dim) =
      l_oi * l_oi.transpose() + factor.oo * factor.oo.transpose();
}

}  // namespace

int theta_dim_per_component(ThetaLayout layout, int input_dim, int output_dim) {
  const int num_means = input_dim + output_dim - first_mean(layout, input_dim);
  return has_psi(layout) ? num_means + input_dim * output_dim : num_means;
}

Eigen::VectorXd to_theta(ThetaLayout layout, const Gmm& gmm) {
  const int num_inputs = gmm.input_dim();
  const int size = theta_dim_per_component(layout, num_inputs, gmm.output_dim());
  const int num_means = gmm.dim() - first_mean(layout, num_inputs);
  Eigen::VectorXd theta(size * gmm.num_components());
  for (int k = 0; k < gmm.num_components(); ++k) {
    theta.segment(k * size, num_means) = gmm[k].mean.tail(num_means);
    if (!has_psi(layout)) continue;
    const Factor factor(gmm[k].covariance, num_inputs);
    const Eigen::MatrixXd psi = is_pourahmadi(layout) ? pourahmadi_psi(factor) : factor.oi;
    int next = k * size + num_means;
    for (Eigen::Index row = 0; row < psi.rows(); ++row) {
      for (Eigen::Index column = 0; column < psi.cols(); ++column) {
        theta[next++] = psi(row, column);
      }
    }
  }
  return theta;
}

Gmm with_theta(ThetaLayout layout, const Gmm& gmm, const Eigen::Ref<const Eigen::VectorXd>& theta) {
  const int num_inputs = gmm.input_dim();
  const int size = theta_dim_per_component(layout, num_inputs, gmm.output_dim());
  const int num_means = gmm.dim() - first_mean(layout, num_inputs);
  CHECK(theta.size() == size * gmm.num_components(), "theta has the size of the layout");
  CHECK(theta.allFinite(), "theta is finite");
  std::vector<Component> components = gmm.components();
  for (int k = 0; k < gmm.num_components(); ++k) {
    Component& component = components[static_cast<std::size_t>(k)];
    component.mean.tail(num_means) = theta.segment(k * size, num_means);
    if (!has_psi(layout)) continue;
    Eigen::MatrixXd psi(gmm.output_dim(), num_inputs);
    int next = k * size + num_means;
    for (Eigen::Index row = 0; row < psi.rows(); ++row) {
      for (Eigen::Index column = 0; column < psi.cols(); ++column) psi(row, column) = theta[next++];
    }
    set_psi(layout, psi, num_inputs, component.covariance);
  }
  return Gmm(num_inputs, std::move(components));
}

}  // namespace treeroll
