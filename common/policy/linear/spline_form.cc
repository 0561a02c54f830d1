#include "common/policy/linear/spline_form.h"

#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include "common/base/check.h"
#include "common/policy/policy_text.h"

namespace treeroll {

SplineLadder::SplineLadder(BSpline coarsest, int num_layers) : layers_{std::move(coarsest)} {
  CHECK(1 <= num_layers && num_layers <= kLayersMax, "so many layers");
  std::vector<Eigen::MatrixXd> steps;
  while (this->num_layers() < num_layers) {
    steps.push_back(layers_.back().insertion());
    layers_.push_back(layers_.back().refined());
  }
  Eigen::MatrixXd lift = Eigen::MatrixXd::Identity(finest().size(), finest().size());
  for (int layer = num_layers; layer >= 1; --layer) {
    if (layer < num_layers) {
      // A copy: the factors of a product must not be its result.
      const Eigen::MatrixXd further = lift * steps[static_cast<std::size_t>(layer - 1)];
      lift = further;
    }
    lifts_.insert(lifts_.begin(), lift);
    const Eigen::LLT<Eigen::MatrixXd> squares(lift.transpose() * lift);
    CHECK(squares.info() == Eigen::Success, "splines are independent");
    drops_.insert(drops_.begin(), layer == num_layers ? lift : squares.solve(lift.transpose()));
  }
}

nlohmann::json SplineForm::content() const {
  std::vector<int> sizes;
  for (int layer = 1; layer <= num_layers(); ++layer) sizes.push_back(ladder_->layer(layer).size());
  const BSpline& finest = ladder_->finest();
  nlohmann::json content = {
      {"degree", finest.degree()}, {"range", {finest.low(), finest.high()}}, {"sizes", sizes}};
  if (recorded_) {
    content["inputs"] = recorded_->inputs();
    content["outputs"] = json_rows(recorded_->outputs());
  }
  return content;
}

}  // namespace treeroll
