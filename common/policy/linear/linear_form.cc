#include "common/policy/linear/linear_form.h"

#include "common/base/check.h"

namespace treeroll {

const Eigen::MatrixXd& LinearForm::lift(int /*layer*/) const {
  CHECK(false, "a form of one layer has no other");
}

const Eigen::MatrixXd& LinearForm::drop(int layer) const { return lift(layer); }

}  // namespace treeroll
