#include "learner/fit/basis_start.h"

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/policy/linear/basis_form.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/linear_fit.h"

namespace treeroll {
namespace {

constexpr int kFunctionsMin = 2;

/// What tells the two kinds apart.
struct BasisKind {
  const char* name;
  const char* size_key;
  int size_max;
  int size_otherwise;  ///< of a constant start
  bool has_goal;       ///< last of an output's coefficients: where the demonstration ends
  /// @param starts  what each output begins with
  std::function<LinearFormPtr(int size, LinearRange range, const std::vector<double>& starts)> form;
  /// Coefficients of an output that is constant.
  std::function<Eigen::RowVectorXd(int size, double value)> constant;
};

int read_size(SettingsReader& policy, const BasisKind& kind, std::optional<int> otherwise) {
  return static_cast<int>(policy.integer(kind.size_key, kFunctionsMin, kind.size_max, otherwise,
                                         {.meaning = "How many of each output", .example = "10"}));
}

/// The outputs where the demonstration begins and ends.
struct EndOutputs {
  std::vector<double> first;
  Eigen::VectorXd last;
};

EndOutputs end_outputs(const Eigen::MatrixXd& data) {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
  data.row(0).minCoeff(&first);
  data.row(0).maxCoeff(&last);
  const Eigen::VectorXd begins = data.col(first).tail(data.rows() - 1);
  return {{begins.begin(), begins.end()}, data.col(last).tail(data.rows() - 1)};
}

StartPolicy constant_basis(SettingsReader& policy, const BasisKind& kind) {
  const LinearRange range = read_linear_range(policy);
  const std::vector<double> values = read_constant_outputs(policy);
  const int size = read_size(policy, kind, kind.size_otherwise);
  LinearFormPtr form = kind.form(size, range, values);
  Eigen::MatrixXd coefficients(values.size(), form->finest().size());
  for (std::size_t o = 0; o < values.size(); ++o) {
    coefficients.row(static_cast<Eigen::Index>(o)) = kind.constant(size, values[o]);
  }
  return {.policy = std::make_shared<LinearPolicy>(std::move(form), std::move(coefficients), 1)};
}

StartPolicy fitted_basis(SettingsReader& policy, const StartSources& sources,
                         const BasisKind& kind) {
  const Demonstration demonstration = read_curve(policy, sources);
  const EndOutputs ends = end_outputs(demonstration.data);
  const auto form = [&](int size) { return kind.form(size, range_of(demonstration), ends.first); };
  const auto fit = [&](int size) {
    return fit_linear_policy(form(size), demonstration.data,
                             kind.has_goal ? ends.last : Eigen::VectorXd());
  };
  std::optional<int> named;
  if (!policy.has(kind.size_key) ||
      policy.is_word(kind.size_key, "auto",
                     {.meaning = "As few as meet the demonstration, of several recordings "
                                 "their mean, within a tenth of its rms"})) {
    policy.string(kind.size_key, "auto",
                  {.meaning = "\"auto\": as few as meet the demonstration, of several recordings "
                              "their mean, within a tenth of its rms; or as many as an integer "
                              "says"});
  } else {
    named = read_size(policy, kind, std::nullopt);
  }
  const int num_goals = kind.has_goal ? 1 : 0;
  const LinearFormOf described{kind.name, [&](int coefficients) {
                                 const int size = coefficients - num_goals;
                                 return named.value_or(size) == size ? form(size) : nullptr;
                               }};
  return linear_start(policy, sources, demonstration, described, [&] {
    if (named) return fit(*named).start;
    try {
      return smallest_sufficient({.sizes = {kFunctionsMin, 1, kSufficientFunctionsMax},
                                  .what = kind.size_key,
                                  .enough = sufficient_error(demonstration.data, 1)},
                                 fit);
    } catch (const FitError& error) {
      policy.refuse(kind.size_key, error.what());
    }
  });
}

StartPolicy read_basis_start(SettingsReader& policy, const StartSources& sources,
                             const BasisKind& kind) {
  const bool is_constant =
      policy.choice("start", {"fit", "constant"}, "fit",
                    {.meaning = "A fit to a demonstration, or one number for each output and no "
                                "demonstration"}) == "constant";
  try {
    return is_constant ? constant_basis(policy, kind) : fitted_basis(policy, sources, kind);
  } catch (const std::invalid_argument& error) {
    policy.refuse(is_constant ? "range" : "demonstration", error.what());
  }
}

}  // namespace

StartPolicy read_rbf_start(SettingsReader& policy, const StartSources& sources) {
  const BasisKind kind{
      .name = "rbf",
      .size_key = "functions",
      .size_max = LinearPolicy::kSizeMax,
      .size_otherwise = 8,
      .has_goal = false,
      .form =
          [](int size, LinearRange range, const std::vector<double>& /*starts*/) {
            return std::make_shared<RadialForm>(RadialBasis(size, range.low, range.high));
          },
      .constant = [](int size, double value) { return Eigen::RowVectorXd::Constant(size, value); }};
  return read_basis_start(policy, sources, kind);
}

StartPolicy read_dmp_start(SettingsReader& policy, const StartSources& sources) {
  const BasisKind kind{.name = "dmp",
                       .size_key = "weights",
                       .size_max = LinearPolicy::kSizeMax - 1,
                       .size_otherwise = 10,
                       .has_goal = true,
                       .form =
                           [](int size, LinearRange range, const std::vector<double>& starts) {
                             return std::make_shared<PrimitiveForm>(
                                 MovementPrimitive(size, range.low, range.high), starts);
                           },
                       .constant =
                           [](int size, double value) {
                             Eigen::RowVectorXd at_goal = Eigen::RowVectorXd::Zero(size + 1);
                             at_goal[size] = value;
                             return at_goal;
                           }};
  return read_basis_start(policy, sources, kind);
}

}  // namespace treeroll
