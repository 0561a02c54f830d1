#include "common/policy/ds_gmr/ds_gmr_policy.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/policy/ds_gmr/spring.h"

namespace treeroll {
namespace {

/// Places of the table of a movement, from both ends of the range on. Where an effect is measured
/// fewer are enough.
constexpr int kPlaces = 1025;
constexpr int kEffectPlaces = 257;

/// The attractor at places equally spaced over the range, pulled along: dO x num_places.
Eigen::MatrixXd movement(Controller& attractor, const DsGmrPolicy::Pull& pull, int num_places) {
  std::vector<double> times(static_cast<std::size_t>(num_places));
  const double step = (pull.high - pull.low) / (num_places - 1);
  for (int n = 0; n < num_places; ++n) times[static_cast<std::size_t>(n)] = pull.low + n * step;
  Eigen::MatrixXd along(attractor.output_dim(), num_places);
  attractor.start();
  attractor.act_all(times, {along.data(), static_cast<std::size_t>(along.size())});
  return pulled_along(along, step, pull.stiffness);
}

class DsGmrController final : public Controller {
 public:
  DsGmrController(Controller& attractor, const DsGmrPolicy::Pull& pull)
      : movement_(movement(attractor, pull, kPlaces)),
        low_(pull.low),
        step_((pull.high - pull.low) / (kPlaces - 1)) {}

  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(movement_.rows()); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    const double place = std::clamp<double>((input[0] - low_) / step_, 0, kPlaces - 1);
    const double before = std::min<double>(std::floor(place), kPlaces - 2);
    const auto n = static_cast<Eigen::Index>(before);
    const double share = place - before;
    for (std::size_t o = 0; o < output.size(); ++o) {
      const auto row = static_cast<Eigen::Index>(o);
      output[o] = (1 - share) * movement_(row, n) + share * movement_(row, n + 1);
    }
  }

 private:
  Eigen::MatrixXd movement_;  // dO x kPlaces
  double low_;
  double step_;
};

/// How far an element is moved for a difference: half of the digits for the step, the others for
/// the difference it makes. A mean input is moved by a thousandth of its Gaussian's deviation,
/// wherever in time that lies, but not by less than the time has digits for.
double difference_step_of(double element, double least) {
  if (least > 0) return std::max(2e-3 / least, 1e-15 * std::abs(element));
  return 1e-5 * std::max(1e-3, std::abs(element));
}

}  // namespace

DsGmrPolicy::DsGmrPolicy(PolicyPtr attractor, const Pull& pull)
    : attractor_(std::move(attractor)), pull_(pull) {
  CHECK(attractor_->input_dim() == 1 && is_pull(pull),
        "a movement over time, pulled within bounds");
}

bool DsGmrPolicy::is_pull(const Pull& pull) {
  const double strength = std::sqrt(pull.stiffness) * (pull.high - pull.low);
  return strength >= 1 && strength <= 1e5;
}

PolicyPtr DsGmrPolicy::at_layer(int layer) const {
  return std::make_shared<DsGmrPolicy>(attractor_->at_layer(layer), pull_);
}

PolicyPtr DsGmrPolicy::with(const Eigen::VectorXd& theta) const {
  return std::make_shared<DsGmrPolicy>(attractor_->with(theta), pull_);
}

std::unique_ptr<Controller> DsGmrPolicy::controller() const {
  return std::make_unique<DsGmrController>(*attractor_->controller(), pull_);
}

NextLayer DsGmrPolicy::next_layer(const Eigen::VectorXd& theta) const {
  NextLayer next = attractor_->next_layer(theta);
  return {std::make_shared<DsGmrPolicy>(std::move(next.policy), pull_), std::move(next.project)};
}

PolicyEffect DsGmrPolicy::effect() const {
  const auto moved = [this](const Eigen::VectorXd& theta) {
    return movement(*attractor_->with(theta)->controller(), pull_, kEffectPlaces);
  };
  const Eigen::VectorXd theta = this->theta();
  const Eigen::MatrixXd outputs = moved(theta);
  PolicyEffect effect{.outputs = outputs.transpose(),
                      .derivative = Eigen::MatrixXd(outputs.size(), theta.size()),
                      .least = attractor_->effect().least};
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    Eigen::VectorXd ahead = theta;
    Eigen::VectorXd behind = theta;
    const double step = difference_step_of(theta[i], effect.least[i]);
    ahead[i] += step;
    behind[i] -= step;
    effect.derivative.col(i) = ((moved(ahead) - moved(behind)) / (ahead[i] - behind[i])).reshaped();
  }
  return effect;
}

PolicySketch DsGmrPolicy::sketch() const {
  PolicySketch sketch = attractor_->sketch();
  for (PolicySketch::Layer& layer : sketch.layers) {
    layer.controller = std::make_unique<DsGmrController>(*layer.controller, pull_);
  }
  sketch.inputs = {{pull_.low, pull_.high}};
  sketch.look += nlohmann::json({pull_.low, pull_.high, pull_.stiffness}).dump();
  return sketch;
}

}  // namespace treeroll
