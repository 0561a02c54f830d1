#include "common/policy/tree/experience.h"

#include <Eigen/Cholesky>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"

namespace treeroll {
namespace {

/// One component of the next layer: `held` says which input marginal theta leaves.
Component projected(const Component& rollout, const Component& held, int num_inputs) {
  const int num_outputs = static_cast<int>(held.mean.size()) - num_inputs;
  const auto slope_of = [&](const Component& component) -> Eigen::MatrixXd {
    const Eigen::MatrixXd s_io = component.covariance.topRightCorner(num_inputs, num_outputs);
    const Eigen::LLT<Eigen::MatrixXd> s_ii(
        component.covariance.topLeftCorner(num_inputs, num_inputs));
    return s_ii.solve(s_io).transpose();
  };
  const Eigen::MatrixXd slope = slope_of(rollout);
  const Eigen::MatrixXd held_slope = slope_of(held);
  const Eigen::MatrixXd s_ii = held.covariance.topLeftCorner(num_inputs, num_inputs);

  Component result = held;
  result.mean.tail(num_outputs) =  // (3-18)
      rollout.mean.tail(num_outputs) +
      slope * (held.mean.head(num_inputs) - rollout.mean.head(num_inputs));
  const Eigen::MatrixXd s_oi = slope * s_ii;  // (3-17)
  // The variance around the line is not theta's: it stays.
  const Eigen::MatrixXd around_line = held.covariance.bottomRightCorner(num_outputs, num_outputs) -
                                      held_slope * s_ii * held_slope.transpose();
  result.covariance.bottomLeftCorner(num_outputs, num_inputs) = s_oi;
  result.covariance.topRightCorner(num_inputs, num_outputs) = s_oi.transpose();
  result.covariance.bottomRightCorner(num_outputs, num_outputs) =
      mirrored(around_line + slope * s_ii * slope.transpose());
  return result;
}

}  // namespace

std::optional<Eigen::VectorXd> project_experience(const TreePolicy& left, const TreePolicy& next,
                                                  const Eigen::VectorXd& theta) {
  CHECK(next.layer() == left.layer() + 1 && next.layout() == left.layout(),
        "experience goes from a layer to the one below it");
  try {
    const Gmm rollout = left.tree_with(theta).layer(next.layer());
    const Gmm mean = next.tree().layer(next.layer());
    // What theta holds of the roll-out's mixture, and the rest as it is: tells the input means and
    // variances the projected mixture has, whatever the layout.
    const Gmm held = with_theta(next.layout(), mean, to_theta(next.layout(), rollout));
    std::vector<Component> components;
    components.reserve(held.components().size());
    for (int k = 0; k < held.num_components(); ++k) {
      components.push_back(projected(rollout[k], held[k], held.input_dim()));
    }
    Eigen::VectorXd result = to_theta(next.layout(), Gmm(held.input_dim(), std::move(components)));
    if (!result.allFinite()) return std::nullopt;
    return result;
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

}  // namespace treeroll
