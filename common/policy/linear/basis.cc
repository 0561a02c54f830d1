#include "common/policy/linear/basis.h"

#include <cstddef>
#include <vector>

namespace treeroll {

Eigen::MatrixXd Basis::matrix(std::span<const double> inputs) const {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(inputs.size()), size());
  std::vector<double> some(static_cast<std::size_t>(num_at_once()));
  for (std::size_t n = 0; n < inputs.size(); ++n) {
    const int first = values(inputs[n], some);
    for (int i = 0; i < num_at_once(); ++i) {
      all(static_cast<Eigen::Index>(n), first + i) = some[static_cast<std::size_t>(i)];
    }
  }
  return all;
}

}  // namespace treeroll
