#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/policy/linear/spline_policy.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kOutputsMax = 32;
constexpr std::size_t kSamplesMax = 10'000;

json rows_of(const Eigen::MatrixXd& numbers) {
  json rows = json::array();
  for (Eigen::Index o = 0; o < numbers.rows(); ++o) {
    const Eigen::RowVectorXd row = numbers.row(o);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

/// @param columns  as many in each row
Eigen::MatrixXd read_rows(const PolicyText& rows, std::size_t min, std::size_t max,
                          std::size_t columns) {
  const std::size_t num_rows = rows.list_size(min, max);
  Eigen::MatrixXd numbers(num_rows, columns);
  for (std::size_t o = 0; o < num_rows; ++o) {
    rows.at(o).list_size(columns, columns);
    for (std::size_t i = 0; i < columns; ++i) {
      numbers(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(i)) =
          rows.at(o).at(i).number();
    }
  }
  return numbers;
}

std::shared_ptr<const SplineLadder> read_ladder(const PolicyText& content) {
  const int degree = content.at("degree").integer(0, BSpline::kDegreeMax);
  const PolicyText ends = content.at("range");
  ends.list_size(2, 2);
  const double low = ends.at(0).number();
  const double high = ends.at(1).number();
  if (!(low < high) || !std::isfinite(high - low)) ends.refuse("must begin before it ends");
  const PolicyText sizes = content.at("sizes");
  const std::size_t num_layers = sizes.list_size(1, SplineLadder::kLayersMax);
  const int coarsest = sizes.at(0).integer(degree + 1, SplineLadder::kSizeMax);
  int size = coarsest;
  for (std::size_t i = 1; i < num_layers; ++i) {
    size = 2 * (size - degree) + degree;
    if (size > SplineLadder::kSizeMax || sizes.at(i).integer(1, SplineLadder::kSizeMax) != size) {
      sizes.at(i).refuse("must have twice the spans of the layer above, and at most 256 numbers");
    }
  }
  return std::make_shared<SplineLadder>(BSpline(degree, coarsest, low, high),
                                        static_cast<int>(num_layers));
}

PolicyPtr read_policy(const PolicyText& content, RecordedCurvePtr recorded) {
  std::shared_ptr<const SplineLadder> ladder = read_ladder(content);
  const auto size = static_cast<std::size_t>(ladder->finest().size());
  const std::size_t num_outputs =
      recorded ? static_cast<std::size_t>(recorded->outputs().rows()) : 0;
  const PolicyText rows = content.at("coefficients");
  Eigen::MatrixXd coefficients =
      read_rows(rows, recorded ? num_outputs : 1, recorded ? num_outputs : kOutputsMax, size);
  const int layer = content.at("layer").integer(1, ladder->num_layers());
  try {
    return std::make_shared<SplinePolicy>(std::move(ladder), std::move(recorded),
                                          std::move(coefficients), layer);
  } catch (const std::invalid_argument& error) {
    rows.refuse(error.what());
  }
}

}  // namespace

nlohmann::json SplinePolicy::content() const {
  std::vector<int> sizes;
  for (int layer = 1; layer <= num_layers(); ++layer) sizes.push_back(ladder_->layer(layer).size());
  const BSpline& finest = ladder_->finest();
  json content = {{"coefficients", rows_of(coefficients_)},
                  {"degree", finest.degree()},
                  {"layer", layer_},
                  {"range", {finest.low(), finest.high()}},
                  {"sizes", sizes}};
  if (recorded_) {
    content["inputs"] = recorded_->inputs();
    content["outputs"] = rows_of(recorded_->outputs());
  }
  return content;
}

PolicyPtr spline_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "degree", "layer", "range", "sizes"});
  return read_policy(content, nullptr);
}

PolicyPtr correction_from_content(const PolicyText& content) {
  content.need_keys({"coefficients", "degree", "inputs", "layer", "outputs", "range", "sizes"});
  const PolicyText inputs = content.at("inputs");
  std::vector<double> times(inputs.list_size(2, kSamplesMax));
  for (std::size_t n = 0; n < times.size(); ++n) times[n] = inputs.at(n).number();
  const std::size_t num_samples = times.size();
  Eigen::MatrixXd outputs = read_rows(content.at("outputs"), 1, kOutputsMax, num_samples);
  try {
    return read_policy(content,
                       std::make_shared<RecordedCurve>(std::move(times), std::move(outputs)));
  } catch (const std::invalid_argument& error) {
    inputs.refuse(error.what());
  }
}

}  // namespace treeroll
