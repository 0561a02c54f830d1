#include "common/policy/linear/spline_policy.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

constexpr double kCoefficientMax = 1e50;
/// Inputs over which an effect is measured.
constexpr int kEffectInputs = 401;

class SplineController final : public Controller {
 public:
  SplineController(BSpline spline, Eigen::MatrixXd coefficients, RecordedCurvePtr recorded)
      : spline_(std::move(spline)),
        coefficients_(std::move(coefficients)),
        recorded_(std::move(recorded)) {}

  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    std::array<double, BSpline::kDegreeMax + 1> values{};
    const int first = spline_.values(input[0], values);
    if (recorded_) recorded_->at(input[0], output);
    for (std::size_t o = 0; o < output.size(); ++o) {
      double sum = recorded_ ? output[o] : 0;
      for (int i = 0; i <= spline_.degree(); ++i) {
        sum += values[static_cast<std::size_t>(i)] *
               coefficients_(static_cast<Eigen::Index>(o), first + i);
      }
      output[o] = sum;
    }
  }

 private:
  BSpline spline_;
  Eigen::MatrixXd coefficients_;  // dO x n
  RecordedCurvePtr recorded_;
};

}  // namespace

SplineLadder::SplineLadder(BSpline coarsest, int num_layers) : layers_{std::move(coarsest)} {
  CHECK(1 <= num_layers && num_layers <= kLayersMax, "so many layers");
  std::vector<Eigen::MatrixXd> steps;
  while (this->num_layers() < num_layers) {
    steps.push_back(layers_.back().insertion());
    layers_.push_back(layers_.back().refined());
  }
  CHECK(finest().size() <= kSizeMax, "so many coefficients");
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

SplinePolicy::SplinePolicy(std::shared_ptr<const SplineLadder> ladder, RecordedCurvePtr recorded,
                           Eigen::MatrixXd coefficients, int layer)
    : ladder_(std::move(ladder)),
      recorded_(std::move(recorded)),
      coefficients_(std::move(coefficients)),
      layer_(layer) {
  CHECK(coefficients_.cols() == ladder_->finest().size() && coefficients_.rows() >= 1 &&
            (!recorded_ || recorded_->outputs().rows() == coefficients_.rows()),
        "coefficients of the finest layer, a row an output");
  CHECK(1 <= layer && layer <= num_layers(), "a layer is from 1 to num_layers()");
  if (!coefficients_.allFinite() || coefficients_.cwiseAbs().maxCoeff() > kCoefficientMax) {
    throw std::invalid_argument(
        fmt::format("a coefficient of a spline is past {:g}", kCoefficientMax));
  }
}

PolicyPtr SplinePolicy::at_layer(int layer) const {
  return std::make_shared<SplinePolicy>(ladder_, recorded_, coefficients_, layer);
}

Eigen::VectorXd SplinePolicy::theta() const {
  const Eigen::MatrixXd of_layer = layer_ == num_layers()
                                       ? Eigen::MatrixXd(coefficients_.transpose())
                                       : ladder_->drop(layer_) * coefficients_.transpose();
  return of_layer.reshaped();
}

Eigen::MatrixXd SplinePolicy::coefficients_with(const Eigen::VectorXd& theta) const {
  const Eigen::MatrixXd wanted = theta.reshaped(ladder_->layer(layer_).size(), output_dim());
  if (layer_ == num_layers()) return wanted.transpose();
  const Eigen::MatrixXd moved = wanted - this->theta().reshaped(wanted.rows(), wanted.cols());
  return coefficients_ + (ladder_->lift(layer_) * moved).transpose();
}

PolicyPtr SplinePolicy::with(const Eigen::VectorXd& theta) const {
  CHECK(theta.size() == theta_dim() && theta.allFinite(), "theta is finite, of this policy's size");
  return std::make_shared<SplinePolicy>(ladder_, recorded_, coefficients_with(theta), layer_);
}

std::unique_ptr<Controller> SplinePolicy::controller_of(int layer) const {
  const Eigen::MatrixXd seen =
      layer == num_layers()
          ? coefficients_
          : Eigen::MatrixXd((ladder_->drop(layer) * coefficients_.transpose()).transpose());
  return std::make_unique<SplineController>(ladder_->layer(layer), seen, recorded_);
}

std::unique_ptr<Controller> SplinePolicy::controller() const { return controller_of(num_layers()); }

NextLayer SplinePolicy::next_layer(const Eigen::VectorXd& theta) const {
  PolicyPtr next =
      std::make_shared<SplinePolicy>(ladder_, recorded_, coefficients_with(theta), layer_ + 1);
  return {next, [left = *this](const Eigen::VectorXd& of_left) -> std::optional<Eigen::VectorXd> {
            const Eigen::VectorXd there =
                (left.ladder_->drop(left.layer_ + 1) * left.coefficients_with(of_left).transpose())
                    .reshaped();
            if (!there.allFinite()) return std::nullopt;
            return there;
          }};
}

Eigen::VectorXd SplinePolicy::noise_variance(std::span<const double> given) const {
  CHECK(static_cast<int>(given.size()) == noise_variance_dim(), "a variance for each output");
  const Eigen::Index size = ladder_->layer(layer_).size();
  Eigen::VectorXd variance(theta_dim());
  for (int o = 0; o < output_dim(); ++o) {
    variance.segment(o * size, size).setConstant(given[static_cast<std::size_t>(o)]);
  }
  return variance;
}

Eigen::MatrixXd SplinePolicy::functions(std::vector<double>& inputs) const {
  const BSpline& spline = ladder_->layer(layer_);
  inputs.resize(kEffectInputs);
  for (int n = 0; n < kEffectInputs; ++n) {
    inputs[static_cast<std::size_t>(n)] =
        spline.low() + (spline.high() - spline.low()) * n / (kEffectInputs - 1);
  }
  return spline.matrix(inputs);
}

Eigen::VectorXd SplinePolicy::steps_of_equal_effect() const {
  std::vector<double> inputs;
  const Eigen::VectorXd mean_square =
      functions(inputs).array().square().colwise().mean().transpose();
  return mean_square.cwiseSqrt().cwiseInverse().replicate(output_dim(), 1);
}

PolicyEffect SplinePolicy::effect() const {
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

PolicySketch SplinePolicy::sketch() const {
  PolicySketch sketch;
  for (int layer = 1; layer <= num_layers(); ++layer) {
    sketch.layers.emplace_back().controller = controller_of(layer);
  }
  sketch.input_low = ladder_->finest().low();
  sketch.input_high = ladder_->finest().high();
  sketch.look = to_json(*at_layer(1));
  return sketch;
}

}  // namespace treeroll
