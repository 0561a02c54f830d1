#include "common/policy/network/network_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"
#include "common/numbers/random_stream.h"

namespace treeroll {
namespace {

constexpr double kNumberMax = 1e50;
/// Inputs over which an effect is measured: on a line, or at random in a box.
constexpr int kLineInputs = 401;
constexpr int kBoxInputs = 512;

class NetworkController final : public Controller {
 public:
  explicit NetworkController(Network network)
      : network_(std::move(network)),
        scaled_(network_.ranges.size()),
        hidden_(static_cast<std::size_t>(network_.num_hidden())) {}

  int input_dim() const override { return network_.num_inputs(); }
  int output_dim() const override { return network_.num_outputs(); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    network_.act(input, scaled_, hidden_, output);
  }

 private:
  Network network_;
  std::vector<double> scaled_;
  std::vector<double> hidden_;
};

/// Spread over the ranges, dI x N: equally on a line, else drawn once and for all.
Eigen::MatrixXd spread_over(const std::vector<Network::Range>& ranges) {
  const int count = ranges.size() == 1 ? kLineInputs : kBoxInputs;
  Eigen::MatrixXd inputs(ranges.size(), count);
  RandomStream draws(0, 0, 0, RandomPurpose::kFit);
  for (int n = 0; n < count; ++n) {
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const double share =
          ranges.size() == 1 ? static_cast<double>(n) / (count - 1) : draws.next_uniform();
      inputs(static_cast<Eigen::Index>(i), n) =
          ranges[i].low + share * (ranges[i].high - ranges[i].low);
    }
  }
  return inputs;
}

}  // namespace

NetworkPolicy::NetworkPolicy(Network network) : network_(std::move(network)) {
  CHECK(network_.outer.rows() >= 1 && network_.inner.rows() >= 1 &&
            network_.outer.cols() == network_.inner.rows() + 1 &&
            network_.inner.cols() == network_.num_inputs() + 1,
        "a network's matrices fit each other");
  const Eigen::VectorXd numbers = network_.numbers();
  if (!numbers.allFinite() || numbers.cwiseAbs().maxCoeff() > kNumberMax) {
    throw std::invalid_argument(fmt::format("a number of a network is past {:g}", kNumberMax));
  }
}

PolicyPtr NetworkPolicy::at_layer(int layer) const {
  CHECK(layer == 1, "a network has one layer");
  return std::make_shared<NetworkPolicy>(network_);
}

PolicyPtr NetworkPolicy::with(const Eigen::VectorXd& theta) const {
  CHECK(theta.size() == theta_dim() && theta.allFinite(), "theta is finite, of this policy's size");
  return std::make_shared<NetworkPolicy>(network_.with(theta));
}

std::unique_ptr<Controller> NetworkPolicy::controller() const {
  return std::make_unique<NetworkController>(network_);
}

NextLayer NetworkPolicy::next_layer(const Eigen::VectorXd& /*theta*/) const {
  CHECK(false, "a network has one layer");
}

Eigen::VectorXd NetworkPolicy::noise_variance(std::span<const double> given) const {
  CHECK(static_cast<int>(given.size()) == noise_variance_dim(), "as many variances as it takes");
  Eigen::VectorXd variance = Eigen::VectorXd::Constant(theta_dim(), given.back());
  for (int o = 0; o < output_dim(); ++o) {
    variance.segment(o * network_.outer.cols(), network_.outer.cols())
        .setConstant(given[static_cast<std::size_t>(o)]);
  }
  return variance;
}

PolicyEffect NetworkPolicy::effect() const {
  const Eigen::MatrixXd inputs = spread_over(network_.ranges);
  PolicyEffect effect{.outputs = Eigen::MatrixXd(inputs.cols(), output_dim()),
                      .derivative = Eigen::MatrixXd(inputs.cols() * output_dim(), theta_dim()),
                      .least = Eigen::VectorXd::Zero(theta_dim())};
  effect.least.tail(network_.inner.size()).setOnes();
  std::vector<double> scaled(network_.ranges.size());
  std::vector<double> hidden(static_cast<std::size_t>(network_.num_hidden()));
  std::vector<double> output(static_cast<std::size_t>(output_dim()));
  Eigen::MatrixXd derivative;
  for (Eigen::Index n = 0; n < inputs.cols(); ++n) {
    network_.act({inputs.col(n).data(), scaled.size()}, scaled, hidden, output);
    network_.derivative(scaled, hidden, derivative);
    effect.derivative.middleRows(n * output_dim(), output_dim()) = derivative;
    for (int o = 0; o < output_dim(); ++o) {
      effect.outputs(n, o) = output[static_cast<std::size_t>(o)];
    }
  }
  return effect;
}

/// An element counts as moving the output by a thousandth of the most that any does at least.
Eigen::VectorXd NetworkPolicy::steps_of_equal_effect() const {
  constexpr double kLeastEffect = 1e-3;
  const PolicyEffect effect = this->effect();
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(effect.derivative.cols());
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    squares += effect.derivative.row(row).transpose().cwiseAbs2();
  }
  squares /= static_cast<double>(effect.outputs.rows());
  const double least = kLeastEffect * kLeastEffect * squares.maxCoeff();
  return squares.cwiseMax(least).cwiseSqrt().cwiseInverse();
}

PolicySketch NetworkPolicy::sketch() const {
  PolicySketch sketch;
  sketch.layers.emplace_back().controller = controller();
  for (const Network::Range& range : network_.ranges) {
    sketch.inputs.push_back({range.low, range.high});
  }
  sketch.look = to_json(*this);
  return sketch;
}

}  // namespace treeroll
