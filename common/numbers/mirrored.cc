#include "common/numbers/mirrored.h"

namespace treeroll {

Eigen::MatrixXd mirrored(const Eigen::MatrixXd& matrix) {
  return matrix.selfadjointView<Eigen::Lower>();
}

void add_square(const Eigen::Ref<const Eigen::VectorXd>& row, Eigen::MatrixXd& matrix) {
  const Eigen::Index size = row.size();
  for (Eigen::Index j = 0; j < size; ++j) {
    if (row[j] != 0) matrix.col(j).tail(size - j) += row[j] * row.tail(size - j);
  }
}

}  // namespace treeroll
