#include "common/policy/linear/linear_policy.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

constexpr double kCoefficientMax = 1e50;
/// Inputs over which an effect is measured.
constexpr int kEffectInputs = 401;

class LinearController final : public Controller {
 public:
  LinearController(LinearFormPtr form, int layer, Eigen::MatrixXd coefficients)
      : form_(std::move(form)),
        basis_(form_->layer(layer)),
        coefficients_(std::move(coefficients)),
        values_(static_cast<std::size_t>(basis_.num_at_once())) {}

  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    const int first = basis_.values(input[0], values_);
    const RecordedCurve* below = form_->below();
    if (below) below->at(input[0], output);
    for (std::size_t o = 0; o < output.size(); ++o) {
      double sum = below ? output[o] : 0;
      for (std::size_t i = 0; i < values_.size(); ++i) {
        sum += values_[i] *
               coefficients_(static_cast<Eigen::Index>(o), first + static_cast<Eigen::Index>(i));
      }
      output[o] = sum;
    }
  }

 private:
  LinearFormPtr form_;
  const Basis& basis_;
  Eigen::MatrixXd coefficients_;  // dO x n
  std::vector<double> values_;
};

}  // namespace

LinearPolicy::LinearPolicy(LinearFormPtr form, Eigen::MatrixXd coefficients, int layer)
    : form_(std::move(form)), coefficients_(std::move(coefficients)), layer_(layer) {
  CHECK(form_->finest().size() <= kSizeMax, "so many coefficients");
  CHECK(coefficients_.cols() == form_->finest().size() && coefficients_.rows() >= 1 &&
            (!form_->below() || form_->below()->outputs().rows() == coefficients_.rows()),
        "coefficients of the finest layer, a row an output");
  CHECK(1 <= layer && layer <= num_layers(), "a layer is from 1 to num_layers()");
  if (!coefficients_.allFinite() || coefficients_.cwiseAbs().maxCoeff() > kCoefficientMax) {
    throw std::invalid_argument(
        fmt::format("a coefficient of a {} is past {:g}", kind(), kCoefficientMax));
  }
}

PolicyPtr LinearPolicy::at_layer(int layer) const {
  return std::make_shared<LinearPolicy>(form_, coefficients_, layer);
}

Eigen::VectorXd LinearPolicy::theta() const {
  const Eigen::MatrixXd of_layer = layer_ == num_layers()
                                       ? Eigen::MatrixXd(coefficients_.transpose())
                                       : form_->drop(layer_) * coefficients_.transpose();
  return of_layer.reshaped();
}

Eigen::MatrixXd LinearPolicy::coefficients_with(const Eigen::VectorXd& theta) const {
  const Eigen::MatrixXd wanted = theta.reshaped(form_->layer(layer_).size(), output_dim());
  if (layer_ == num_layers()) return wanted.transpose();
  const Eigen::MatrixXd moved = wanted - this->theta().reshaped(wanted.rows(), wanted.cols());
  return coefficients_ + (form_->lift(layer_) * moved).transpose();
}

PolicyPtr LinearPolicy::with(const Eigen::VectorXd& theta) const {
  CHECK(theta.size() == theta_dim() && theta.allFinite(), "theta is finite, of this policy's size");
  return std::make_shared<LinearPolicy>(form_, coefficients_with(theta), layer_);
}

std::unique_ptr<Controller> LinearPolicy::controller_of(int layer) const {
  const Eigen::MatrixXd seen =
      layer == num_layers()
          ? coefficients_
          : Eigen::MatrixXd((form_->drop(layer) * coefficients_.transpose()).transpose());
  return std::make_unique<LinearController>(form_, layer, seen);
}

std::unique_ptr<Controller> LinearPolicy::controller() const { return controller_of(num_layers()); }

NextLayer LinearPolicy::next_layer(const Eigen::VectorXd& theta) const {
  PolicyPtr next = std::make_shared<LinearPolicy>(form_, coefficients_with(theta), layer_ + 1);
  return {next, [left = *this](const Eigen::VectorXd& of_left) -> std::optional<Eigen::VectorXd> {
            const Eigen::VectorXd there =
                (left.form_->drop(left.layer_ + 1) * left.coefficients_with(of_left).transpose())
                    .reshaped();
            if (!there.allFinite()) return std::nullopt;
            return there;
          }};
}

Eigen::VectorXd LinearPolicy::noise_variance(std::span<const double> given) const {
  CHECK(static_cast<int>(given.size()) == noise_variance_dim(), "a variance for each output");
  const Eigen::Index size = form_->layer(layer_).size();
  Eigen::VectorXd variance(theta_dim());
  for (int o = 0; o < output_dim(); ++o) {
    variance.segment(o * size, size).setConstant(given[static_cast<std::size_t>(o)]);
  }
  return variance;
}

Eigen::MatrixXd LinearPolicy::functions(std::vector<double>& inputs) const {
  const Basis& basis = form_->layer(layer_);
  inputs.resize(kEffectInputs);
  for (int n = 0; n < kEffectInputs; ++n) {
    inputs[static_cast<std::size_t>(n)] =
        basis.low() + (basis.high() - basis.low()) * n / (kEffectInputs - 1);
  }
  return basis.matrix(inputs);
}

Eigen::VectorXd LinearPolicy::steps_of_equal_effect() const {
  std::vector<double> inputs;
  const Eigen::VectorXd mean_square =
      functions(inputs).array().square().colwise().mean().transpose();
  return mean_square.cwiseSqrt().cwiseInverse().replicate(output_dim(), 1);
}

PolicyEffect LinearPolicy::effect() const {
  std::vector<double> inputs;
  const Eigen::MatrixXd of_output = functions(inputs);
  const Eigen::Index size = of_output.cols();
  PolicyEffect effect{
      .outputs = Eigen::MatrixXd(of_output.rows(), output_dim()),
      .derivative = Eigen::MatrixXd::Zero(of_output.rows() * output_dim(), theta_dim()),
      .least = Eigen::VectorXd::Zero(theta_dim())};
  const std::unique_ptr<Controller> acting = controller();
  std::vector<double> output(static_cast<std::size_t>(output_dim()));
  for (Eigen::Index n = 0; n < of_output.rows(); ++n) {
    acting->act({&inputs[static_cast<std::size_t>(n)], 1}, output);
    for (int o = 0; o < output_dim(); ++o) {
      effect.outputs(n, o) = output[static_cast<std::size_t>(o)];
      effect.derivative.block(n * output_dim() + o, o * size, 1, size) = of_output.row(n);
    }
  }
  return effect;
}

nlohmann::json LinearPolicy::content() const {
  nlohmann::json content = form_->content();
  content["coefficients"] = json_rows(coefficients_);
  content["layer"] = layer_;
  return content;
}

PolicySketch LinearPolicy::sketch() const {
  PolicySketch sketch;
  for (int layer = 1; layer <= num_layers(); ++layer) {
    sketch.layers.emplace_back().controller = controller_of(layer);
  }
  sketch.inputs.push_back({form_->finest().low(), form_->finest().high()});
  sketch.look = to_json(*at_layer(1));
  return sketch;
}

}  // namespace treeroll
