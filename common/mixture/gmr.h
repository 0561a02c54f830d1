#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/mixture/gmm.h"
#include "common/mixture/gmr_kernel.h"

namespace treeroll {

/// Which variance of the outputs is asked for.
enum class VarianceKind {
  kAsPrinted,  ///< sum_k h_k^2 S_k, (A-10) as the thesis prints it: Calinon's approximation
  kTotal,      ///< sum_k h_k (S_k + m_k m_k^T) - m m^T, the variance of the mixture
};

/// Gaussian mixture regression prepared for many inputs: thesis, (A-9), (A-11).
/// Uses the portable elementary functions, so a policy gives the same bits everywhere.
///
///   const Gmr gmr(policy.decode(theta));
///   const double cart_acceleration_mps2 = gmr.regress(time_s);
class Gmr {
 public:
  explicit Gmr(const Gmm& gmm);

  int input_dim() const { return input_dim_; }
  int output_dim() const { return output_dim_; }

  /// Mean of the outputs given the input, (A-9).
  /// @param input   dI x 1, finite, in the units of the mixture; past +-kGmmMagnitudeMax it counts
  ///                as that bound
  /// @return        dO x 1. Far from every component the nearest one decides: never NaN.
  Eigen::VectorXd regress(const Eigen::Ref<const Eigen::VectorXd>& input) const;

  /// What a regression works on; made once for many inputs.
  struct WorkSpace {
    Eigen::VectorXd input;              ///< dI, bounded
    Eigen::VectorXd difference;         ///< dI, from a component's mean
    std::vector<double> log_densities;  ///< of the prepared components
    Eigen::VectorXd weights;            ///< K, (A-11)
    Eigen::VectorXd conditional;        ///< dO, (A-7)
    Eigen::VectorXd mean;               ///< dO, (A-9)
    std::vector<double> lanes;          ///< a weight a component and lane
  };
  WorkSpace work_space() const;
  /// The same without allocating. Precondition: `work` is of this regression, the spans have dI and
  /// dO numbers.
  void regress(std::span<const double> input, WorkSpace& work, std::span<double> output) const;

  /// The same for one input and one output: precondition dI = dO = 1.
  double regress(double input) const;

  /// The same for inputs one after the other, to the bit, several at a time where dI = 1.
  /// @param inputs   N x dI, row by row
  /// @param outputs  N x dO, row by row
  void regress_all(std::span<const double> inputs, WorkSpace& work,
                   std::span<double> outputs) const;

  /// Weights h_k(input), (A-11): K x 1, sum 1, by log-sum-exp.
  Eigen::VectorXd weights(const Eigen::Ref<const Eigen::VectorXd>& input) const;

  /// Variance of the outputs given the input, dO x dO.
  Eigen::MatrixXd variance(const Eigen::Ref<const Eigen::VectorXd>& input, VarianceKind kind) const;

 private:
  /// A component whose prior is not zero, ready for and.
  struct Prepared {
    int component = 0;                       ///< index in the mixture
    Eigen::VectorXd mean_input;              ///< dI
    Eigen::MatrixXd factor_input;            ///< dI x dI, lower Cholesky factor of S_II
    Eigen::MatrixXd slope;                   ///< dO x dI, A = S_OI S_II^-1
    Eigen::VectorXd mean_output;             ///< dO
    Eigen::MatrixXd conditional_covariance;  ///< dO x dO, (A-8)
    double log_weight = 0;                   ///< log(pi_k) - log(det(factor_input))
  };
  /// gmr_kernel::Lines, for one input.
  struct LineMixture {
    std::vector<double> mean_input, precision, log_weight, slope, mean_output;
  };
  gmr_kernel::Lines lines() const;

  /// Into work.conditional, (A-7), for work.input.
  void take_conditional_mean(const Prepared& prepared, WorkSpace& work) const;
  /// Into work.weights, (A-11), for work.input.
  void take_weights(WorkSpace& work) const;

  int input_dim_;
  int output_dim_;
  int num_components_;
  std::vector<Prepared> prepared_;
  LineMixture line_mixture_;  ///< empty unless dI = 1
};

}  // namespace treeroll
