#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/policy/input_range.h"
#include "common/policy/linear/basis_form.h"
#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"

namespace treeroll {
namespace {

constexpr std::size_t kSamplesMax = 10'000;

struct Ends {
  double low;
  double high;
};

Ends read_range(const PolicyText& content) {
  const PolicyText ends = content.at("range");
  ends.list_size(2, 2);
  const Ends range{ends.at(0).number(), ends.at(1).number()};
  if (!is_input_range(range.low, range.high)) ends.refuse(kInputRangeRule);
  return range;
}

std::shared_ptr<const SplineLadder> read_ladder(const PolicyText& content) {
  const int degree = content.at("degree").integer(0, BSpline::kDegreeMax);
  const Ends range = read_range(content);
  const PolicyText sizes = content.at("sizes");
  const std::size_t num_layers = sizes.list_size(1, SplineLadder::kLayersMax);
  const int coarsest = sizes.at(0).integer(degree + 1, LinearPolicy::kSizeMax);
  int size = coarsest;
  for (std::size_t i = 1; i < num_layers; ++i) {
    size = BSpline::refined_size(degree, size);
    if (size > LinearPolicy::kSizeMax || sizes.at(i).integer(1, LinearPolicy::kSizeMax) != size) {
      sizes.at(i).refuse("must have twice the spans of the layer above, and at most " +
                         std::to_string(LinearPolicy::kSizeMax) + " numbers");
    }
  }
  return std::make_shared<SplineLadder>(BSpline(degree, coarsest, range.low, range.high),
                                        static_cast<int>(num_layers));
}

/// Coefficients: as many rows as the curve below has outputs, if there is one.
Eigen::MatrixXd read_coefficients(const PolicyText& content, std::size_t num_outputs,
                                  std::size_t size_min, std::size_t size_max) {
  return content.at("coefficients")
      .rows({std::max<std::size_t>(num_outputs, 1),
             num_outputs > 0 ? num_outputs : LinearPolicy::kOutputsMax},
            {size_min, size_max});
}

PolicyPtr policy_of(const PolicyText& content, LinearFormPtr form, Eigen::MatrixXd coefficients) {
  const int layer = content.at("layer").integer(1, form->num_layers());
  try {
    return std::make_shared<LinearPolicy>(std::move(form), std::move(coefficients), layer);
  } catch (const std::invalid_argument& error) {
    content.at("coefficients").refuse(error.what());
  }
}

PolicyPtr spline_policy(const PolicyText& content, RecordedCurvePtr recorded) {
  std::shared_ptr<const SplineLadder> ladder = read_ladder(content);
  const auto size = static_cast<std::size_t>(ladder->finest().size());
  Eigen::MatrixXd coefficients = read_coefficients(
      content, recorded ? static_cast<std::size_t>(recorded->outputs().rows()) : 0, size, size);
  return policy_of(content, std::make_shared<SplineForm>(std::move(ladder), std::move(recorded)),
                   std::move(coefficients));
}

}  // namespace

PolicyPtr spline_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "degree", "layer", "range", "sizes"});
  return spline_policy(content, nullptr);
}

PolicyPtr correction_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "degree", "inputs", "layer", "outputs", "range", "sizes"});
  const PolicyText inputs = content.at("inputs");
  std::vector<double> times(inputs.list_size(2, kSamplesMax));
  for (std::size_t n = 0; n < times.size(); ++n) times[n] = inputs.at(n).number();
  Eigen::MatrixXd outputs =
      content.at("outputs").rows({1, LinearPolicy::kOutputsMax}, {times.size(), times.size()});
  RecordedCurvePtr recorded;
  try {
    recorded = std::make_shared<RecordedCurve>(std::move(times), std::move(outputs));
  } catch (const std::invalid_argument& error) {
    inputs.refuse(error.what());
  }
  return spline_policy(content, std::move(recorded));
}

PolicyPtr rbf_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "layer", "range"});
  const Ends range = read_range(content);
  Eigen::MatrixXd coefficients = read_coefficients(content, 0, 2, LinearPolicy::kSizeMax);
  RadialBasis basis(static_cast<int>(coefficients.cols()), range.low, range.high);
  return policy_of(content, std::make_shared<RadialForm>(std::move(basis)),
                   std::move(coefficients));
}

PolicyPtr dmp_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "layer", "range", "starts"});
  const Ends range = read_range(content);
  const PolicyText from = content.at("starts");
  std::vector<double> starts(from.list_size(1, LinearPolicy::kOutputsMax));
  for (std::size_t o = 0; o < starts.size(); ++o) starts[o] = from.at(o).number();
  Eigen::MatrixXd coefficients =
      read_coefficients(content, starts.size(), 3, LinearPolicy::kSizeMax);
  MovementPrimitive basis(static_cast<int>(coefficients.cols()) - 1, range.low, range.high);
  try {
    return policy_of(content, std::make_shared<PrimitiveForm>(std::move(basis), std::move(starts)),
                     std::move(coefficients));
  } catch (const std::invalid_argument& error) {
    content.at("range").refuse(error.what());
  }
}

}  // namespace treeroll
