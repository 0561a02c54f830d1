#include "learner/fit/linear_fit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/policy/input_range.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/missing_outputs.h"
#include "learner/fit/relative_error.h"

namespace treeroll {
namespace {

constexpr double kRidge = 1e-9;

/// What the curve below gives at the inputs of the data: dO x N.
Eigen::MatrixXd below_at(const RecordedCurve* below, const Eigen::MatrixXd& data) {
  Eigen::MatrixXd outputs = Eigen::MatrixXd::Zero(data.rows() - 1, data.cols());
  if (!below) return outputs;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    below->at(data(0, n), {outputs.col(n).data(), static_cast<std::size_t>(outputs.rows())});
  }
  return outputs;
}

}  // namespace

Eigen::MatrixXd fit_linear(const Basis& basis, const RecordedCurve* below,
                           const Eigen::MatrixXd& data, const Eigen::VectorXd& last) {
  const int num_known = last.size() > 0 ? 1 : 0;
  const int size = basis.size() - num_known;
  Eigen::MatrixXd wanted = data.bottomRows(data.rows() - 1) - below_at(below, data);
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(size, size);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(size, wanted.rows());
  std::vector<double> values(static_cast<std::size_t>(basis.num_at_once()));
  // Sums are written out, sample by sample: the same bits on every machine.
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    const int first = basis.values(data(0, n), values);
    const int end = std::min(basis.num_at_once(), size - first);
    if (num_known > 0 && end < basis.num_at_once()) wanted.col(n) -= values.back() * last;
    for (int i = 0; i < end; ++i) {
      const double value = values[static_cast<std::size_t>(i)];
      for (int j = 0; j < end; ++j) {
        squares(first + i, first + j) += value * values[static_cast<std::size_t>(j)];
      }
      for (Eigen::Index o = 0; o < products.cols(); ++o) {
        products(first + i, o) += value * wanted(o, n);
      }
    }
  }
  squares.diagonal().array() += kRidge * squares.trace() / static_cast<double>(size);
  Eigen::MatrixXd coefficients(wanted.rows(), basis.size());
  coefficients.leftCols(size) = squares.llt().solve(products).transpose();
  if (num_known > 0) coefficients.rightCols(1) = last;
  return coefficients;
}

Fitted<std::shared_ptr<LinearPolicy>> fit_linear_policy(LinearFormPtr form,
                                                        const Eigen::MatrixXd& data,
                                                        const Eigen::VectorXd& last) {
  Eigen::MatrixXd coefficients = fit_linear(form->finest(), form->below(), data, last);
  auto policy = std::make_shared<LinearPolicy>(std::move(form), std::move(coefficients), 1);
  Eigen::MatrixXd curve(data.rows() - 1, data.cols());
  const std::unique_ptr<Controller> acting = policy->controller();
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    acting->act({&data(0, n), 1}, {curve.col(n).data(), static_cast<std::size_t>(curve.rows())});
  }
  const double error = relative_rms(curve, data.bottomRows(data.rows() - 1));
  return {std::move(policy), error};
}

LinearRange read_linear_range(SettingsReader& policy) {
  const std::vector<double> ends = policy.numbers(
      "range", kAnyNumber, 2, 2, {},
      {.meaning = "The inputs that the policy is over, first and last", .example = "[0.0, 2.0]"});
  if (!is_input_range(ends[0], ends[1])) policy.refuse("range", kInputRangeRule);
  return {ends[0], ends[1]};
}

std::vector<double> read_constant_outputs(SettingsReader& policy) {
  return policy.numbers("values", {.min = -1e50, .max = 1e50}, 1, LinearPolicy::kOutputsMax,
                        std::vector<double>{0}, {.meaning = "What each output begins with"});
}

Demonstration read_curve(SettingsReader& policy, const StartSources& sources) {
  Demonstration demonstration = read_demonstration(policy.table("demonstration"), sources);
  if (demonstration.input_dim != 1) {
    policy.refuse("demonstration", "of this kind of policy must have one input");
  }
  if (!is_complete(demonstration.data)) {
    policy.refuse("demonstration",
                  "of this kind of policy must have all outputs: some are missing");
  }
  const LinearRange range = range_of(demonstration);
  if (!is_input_range(range.low, range.high)) {
    policy.refuse("demonstration", std::string("the range of its input ") + kInputRangeRule);
  }
  return demonstration;
}

LinearRange range_of(const Demonstration& demonstration) {
  return {demonstration.data.row(0).minCoeff(), demonstration.data.row(0).maxCoeff()};
}

StartPolicy linear_start(SettingsReader& policy, const StartSources& sources,
                         const Demonstration& demonstration, const LinearFormOf& form,
                         const std::function<std::shared_ptr<LinearPolicy>()>& fit) {
  StartPolicy start{.policy = {},
                    .log_likelihoods = {},
                    .demonstration = std::make_shared<const Eigen::MatrixXd>(demonstration.data),
                    .demonstration_text = demonstration.text};
  if (!sources.fitted) {
    start.policy = fit();
    return start;
  }
  const auto* known = dynamic_cast<const LinearPolicy*>(sources.fitted->policy.get());
  const auto require = [&](bool holds, const char* what) {
    if (holds) return;
    policy.refuse("demonstration",
                  fmt::format("the study's stored start is another one: its {} differs", what));
  };
  require(known != nullptr && known->kind() == form.kind, "kind");
  require(known->layer() == 1, "explored layer");
  const LinearFormPtr described = form.of_size(static_cast<int>(known->coefficients().cols()));
  require(described != nullptr && known->output_dim() + 1 == demonstration.data.rows() &&
              known->form().content() == described->content(),
          "number of coefficients, layers or outputs");
  start.policy = sources.fitted->policy;
  return start;
}

}  // namespace treeroll
