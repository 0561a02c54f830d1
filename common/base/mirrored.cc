#include "common/base/mirrored.h"

namespace treeroll {

Eigen::MatrixXd mirrored(const Eigen::MatrixXd& matrix) {
  return matrix.selfadjointView<Eigen::Lower>();
}

}  // namespace treeroll
