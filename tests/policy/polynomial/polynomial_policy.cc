#include "tests/policy/polynomial/polynomial_policy.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr double kCoefficientMax = 1e50;
constexpr int kDegreeMax = 16;
constexpr std::size_t kOutputsMax = 32;
constexpr std::size_t kLayersMax = 8;

class PolynomialController final : public Controller {
 public:
  PolynomialController(PolynomialPolicy::Range range, Eigen::MatrixXd coefficients)
      : range_(range), coefficients_(std::move(coefficients)) {}

  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    const double time = std::clamp(input[0], range_.low, range_.high);
    const double x = (time - range_.low) / (range_.high - range_.low);
    for (Eigen::Index o = 0; o < coefficients_.rows(); ++o) {
      double sum = 0;
      for (Eigen::Index j = coefficients_.cols(); j-- > 0;) sum = sum * x + coefficients_(o, j);
      output[static_cast<std::size_t>(o)] = sum;
    }
  }

 private:
  PolynomialPolicy::Range range_;
  Eigen::MatrixXd coefficients_;
};

}  // namespace

PolynomialPolicy::PolynomialPolicy(std::vector<int> degrees, Range range,
                                   Eigen::MatrixXd coefficients, int layer)
    : degrees_(std::move(degrees)),
      range_(range),
      coefficients_(std::move(coefficients)),
      layer_(layer) {}

PolicyPtr PolynomialPolicy::at_layer(int layer) const {
  return std::make_shared<PolynomialPolicy>(degrees_, range_, coefficients_, layer);
}

Eigen::VectorXd PolynomialPolicy::theta() const {
  const Eigen::MatrixXd explored = coefficients_.leftCols(num_explored()).transpose();
  return explored.reshaped();
}

Eigen::MatrixXd PolynomialPolicy::coefficients_with(const Eigen::VectorXd& theta) const {
  if (theta.cwiseAbs().maxCoeff() > kCoefficientMax) {
    throw std::invalid_argument("a coefficient is past its bound");
  }
  Eigen::MatrixXd coefficients = coefficients_;
  coefficients.leftCols(num_explored()) = theta.reshaped(num_explored(), output_dim()).transpose();
  return coefficients;
}

PolicyPtr PolynomialPolicy::with(const Eigen::VectorXd& theta) const {
  return std::make_shared<PolynomialPolicy>(degrees_, range_, coefficients_with(theta), layer_);
}

std::unique_ptr<Controller> PolynomialPolicy::controller() const {
  return std::make_unique<PolynomialController>(range_, coefficients_);
}

NextLayer PolynomialPolicy::next_layer(const Eigen::VectorXd& theta) const {
  const PolynomialPolicy left = *this;
  return {with(theta)->at_layer(layer_ + 1), [left](const Eigen::VectorXd& of_left) {
            return std::optional(left.with(of_left)->at_layer(left.layer_ + 1)->theta());
          }};
}

Eigen::VectorXd PolynomialPolicy::noise_variance(std::span<const double> given) const {
  const Eigen::Map<const Eigen::RowVectorXd> of_output(given.data(), output_dim());
  return of_output.replicate(num_explored(), 1).reshaped();
}

Eigen::VectorXd PolynomialPolicy::steps_of_equal_effect() const {
  Eigen::VectorXd steps(num_explored());
  for (int j = 0; j < num_explored(); ++j) steps[j] = std::sqrt(2. * j + 1);
  return steps.replicate(output_dim(), 1);
}

PolicyEffect PolynomialPolicy::effect() const {
  constexpr int kInputs = 101;
  const int size = num_explored();
  PolicyEffect effect{.outputs = Eigen::MatrixXd::Zero(kInputs, output_dim()),
                      .derivative = Eigen::MatrixXd::Zero(kInputs * output_dim(), theta_dim()),
                      .least = Eigen::VectorXd::Zero(theta_dim())};
  for (int n = 0; n < kInputs; ++n) {
    for (int o = 0; o < output_dim(); ++o) {
      for (Eigen::Index j = coefficients_.cols(); j-- > 0;) {
        const double power = std::pow(n / (kInputs - 1.), j);
        effect.outputs(n, o) += coefficients_(o, j) * power;
        if (j < size) effect.derivative(n * output_dim() + o, o * size + j) = power;
      }
    }
  }
  return effect;
}

PolicySketch PolynomialPolicy::sketch() const {
  PolicySketch sketch;
  for (const int degree : degrees_) {
    sketch.layers.push_back(
        {{}, std::make_unique<PolynomialController>(range_, coefficients_.leftCols(degree + 1))});
  }
  sketch.inputs.push_back({range_.low, range_.high});
  sketch.look = to_json(*at_layer(1));
  return sketch;
}

json PolynomialPolicy::content() const {
  json rows = json::array();
  for (Eigen::Index o = 0; o < coefficients_.rows(); ++o) {
    const Eigen::RowVectorXd row = coefficients_.row(o);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return {{"coefficients", std::move(rows)},
          {"degrees", degrees_},
          {"layer", layer_},
          {"range", {range_.low, range_.high}}};
}

PolicyPtr polynomial_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "degrees", "layer", "range"});
  std::vector<int> degrees;
  const PolicyText ladder = content.at("degrees");
  const std::size_t num_layers = ladder.list_size(1, kLayersMax);
  for (std::size_t i = 0; i < num_layers; ++i) {
    degrees.push_back(ladder.at(i).integer(i == 0 ? 0 : degrees.back() + 1, kDegreeMax));
  }
  const PolicyText ends = content.at("range");
  ends.list_size(2, 2);
  const PolynomialPolicy::Range range{ends.at(0).number(), ends.at(1).number()};
  if (!(range.low < range.high)) ends.refuse("must begin before it ends");
  const PolicyText rows = content.at("coefficients");
  const std::size_t num_outputs = rows.list_size(1, kOutputsMax);
  const auto size = static_cast<std::size_t>(degrees.back()) + 1;
  Eigen::MatrixXd coefficients(num_outputs, size);
  for (std::size_t o = 0; o < num_outputs; ++o) {
    rows.at(o).list_size(size, size);
    for (std::size_t j = 0; j < size; ++j) {
      const double number = rows.at(o).at(j).number();
      if (!(std::abs(number) <= kCoefficientMax)) rows.at(o).at(j).refuse("is past its bound");
      coefficients(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(j)) = number;
    }
  }
  const int layer = content.at("layer").integer(1, static_cast<int>(num_layers));
  return std::make_shared<PolynomialPolicy>(degrees, range, std::move(coefficients), layer);
}

StartPolicy read_polynomial_start(SettingsReader& policy, const StartSources& /*sources*/) {
  const auto num_outputs = policy.integer("outputs", 1, kOutputsMax, 1);
  std::vector<int> degrees;
  for (const double degree :
       policy.numbers("degrees", {.min = 0, .max = kDegreeMax}, 1, kLayersMax, {{1, 3}})) {
    if (degree != std::floor(degree) || (!degrees.empty() && degree <= degrees.back())) {
      policy.refuse("degrees", "must hold integers that rise");
    }
    degrees.push_back(static_cast<int>(degree));
  }
  const std::vector<double> ends = policy.numbers("range", kAnyNumber, 2, 2, {{0, 1}});
  if (!(ends[0] < ends[1])) policy.refuse("range", "must begin before it ends");
  return {.policy = std::make_shared<PolynomialPolicy>(
              degrees, PolynomialPolicy::Range{ends[0], ends[1]},
              Eigen::MatrixXd::Zero(num_outputs, degrees.back() + 1), 1)};
}

}  // namespace treeroll
