#pragma once

#include <Eigen/Core>
#include <vector>

namespace treeroll {

/// One weighted Gaussian of a mixture. A value; checked when it becomes part of a Gmm.
struct Component {
  double prior = 0;            ///< pi_k
  Eigen::VectorXd mean;        ///< d x 1, [input; output]
  Eigen::MatrixXd covariance;  ///< d x d, symmetric positive definite
};

/// Bounds of the numbers of a mixture: no mean is farther from 0, no variance is smaller or
/// larger. They keep every product in a regression far from overflow.
inline constexpr double kGmmMagnitudeMax = 1e50;
inline constexpr double kGmmVarianceMin = 1e-50;

/// Gaussian mixture over [input; output], thesis, (A-5), (A-6). Immutable.
class Gmm {
 public:
  /// Throws std::invalid_argument naming the component and the rule if: there is no component; the
  /// sizes differ; input_dim is not in [1, d); a number is not finite or past the bounds above; a
  /// prior is negative or all are zero; a covariance is not symmetric (up to rounding: the lower
  /// triangle is then taken for both) or not positive definite. Priors are kept as given: GMR does
  /// not need them to sum to one.
  Gmm(int input_dim, std::vector<Component> components);

  int input_dim() const { return input_dim_; }                              ///< dI
  int output_dim() const { return dim() - input_dim_; }                     ///< dO
  int dim() const { return static_cast<int>(components_[0].mean.size()); }  ///< d
  int num_components() const { return static_cast<int>(components_.size()); }
  const std::vector<Component>& components() const { return components_; }
  const Component& operator[](int k) const { return components_[static_cast<std::size_t>(k)]; }

 private:
  int input_dim_;
  std::vector<Component> components_;
};

}  // namespace treeroll
