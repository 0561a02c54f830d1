#include "learner/web/views/policy_view.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "common/numbers/random_stream.h"
#include "common/policy/policy_bounds.h"
#include "learner/explore/perturbation.h"

namespace treeroll::web {
namespace {

using nlohmann::json;

constexpr int kCurvePoints = 160;
constexpr int kNoisePoints = 64;
constexpr std::uint32_t kNumDraws = 12;
/// Of more elements of theta than this a factor of the noise takes too long for a look.
constexpr Eigen::Index kThetaMax = 300;
constexpr std::size_t kGaussiansMax = 200;
constexpr Eigen::Index kSamplesMax = 300;

std::vector<double> spaced(double low, double high, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(low + (high - low) * i / (count - 1));
  return values;
}

/// Each output over the inputs. Precondition: a policy of one input.
std::vector<std::vector<double>> outputs_over(Controller& controller,
                                              const std::vector<double>& inputs, int output_dim) {
  std::vector<std::vector<double>> outputs(static_cast<std::size_t>(output_dim));
  std::vector<double> output(static_cast<std::size_t>(output_dim));
  for (const double input : inputs) {
    controller.act(std::span(&input, 1), output);
    for (std::size_t i = 0; i < outputs.size(); ++i) outputs[i].push_back(output[i]);
  }
  return outputs;
}

std::vector<double> list_of(const Eigen::MatrixXd& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

json layer_view(const PolicySketch::Layer& layer, const PolicySketch& sketch, int input_dim,
                int output_dim) {
  json view{{"gaussians", json::array()}, {"left_out", 0}};
  for (const PolicySketch::Gaussian& gaussian : layer.gaussians) {
    if (view["gaussians"].size() == kGaussiansMax) {
      view["left_out"] = layer.gaussians.size() - kGaussiansMax;
      break;
    }
    view["gaussians"].push_back(
        {{"mean", list_of(gaussian.mean)}, {"covariance", list_of(gaussian.covariance)}});
  }
  if (input_dim != 1 || !layer.controller) return view;
  const auto [low, high] = sketch.inputs.front();
  const std::vector<double> inputs = spaced(low, high, kCurvePoints);
  view["inputs"] = inputs;
  view["outputs"] = outputs_over(*layer.controller, inputs, output_dim);
  return view;
}

}  // namespace

json policy_view(const Policy& policy) {
  const PolicySketch sketch = policy.sketch();
  json view{{"kind", policy.kind()},
            {"input_dim", policy.input_dim()},
            {"output_dim", policy.output_dim()},
            {"layer", policy.layer()},
            {"low", sketch.inputs.front().low},
            {"high", sketch.inputs.front().high},
            {"layers", json::array()}};
  for (const PolicySketch::Layer& layer : sketch.layers) {
    view["layers"].push_back(layer_view(layer, sketch, policy.input_dim(), policy.output_dim()));
  }
  return view;
}

json noise_view(const Policy& policy, const Eigen::VectorXd& mean, const Eigen::MatrixXd& noise) {
  json view{{"inputs", json::array()}, {"draws", json::array()}};
  if (policy.input_dim() != 1 || mean.size() > kThetaMax) return view;
  const PolicySketch sketch = policy.sketch();
  const auto [low, high] = sketch.inputs.front();
  const std::vector<double> inputs = spaced(low, high, kNoisePoints);
  view["inputs"] = inputs;
  // What a run has come to after its last update it never draws from.
  const std::optional<Eigen::MatrixXd> factor = explore::noise_factor_if_any(noise);
  if (!factor) return view;
  for (std::uint32_t draw = 0; draw < kNumDraws; ++draw) {
    const RandomStream stream(0, 0, draw, RandomPurpose::kPerturbation);
    const Eigen::VectorXd theta =
        explore::perturb(mean, *factor, explore::normal_numbers(mean.size(), stream));
    try {
      // Drawn as sketch() is: a rate's bound means nothing between points so far apart.
      const auto controller = without_bounds(policy.with(theta))->controller();
      view["draws"].push_back(outputs_over(*controller, inputs, policy.output_dim()));
    } catch (const std::invalid_argument&) {
      continue;  // a theta that makes no policy: its roll-out would fail
    }
  }
  return view;
}

json samples_view(const Eigen::MatrixXd& samples) {
  json view = json::array();
  const Eigen::Index count = std::min(samples.cols(), kSamplesMax);
  for (Eigen::Index row = 0; row < samples.rows(); ++row) {
    json values = json::array();
    for (Eigen::Index i = 0; i < count; ++i) {
      values.push_back(samples(row, i * samples.cols() / count));
    }
    view.push_back(std::move(values));
  }
  return view;
}

}  // namespace treeroll::web
