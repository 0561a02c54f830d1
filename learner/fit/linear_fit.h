#pragma once

#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "common/policy/linear/linear_policy.h"
#include "common/policy/policy_registry.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/sufficient.h"

namespace treeroll {

/// How far a number of functions "auto" looks.
inline constexpr int kSufficientFunctionsMax = 64;

/// Coefficients whose curve is nearest to the data: argmin |Phi c + b - u|^2, with a billionth of
/// the mean square of Phi for those that no sample sees.
/// @param data   (1 + dO) x N, inputs over outputs
/// @param below  b; null for none
/// @param last   the coefficient of the last function for each output, where it is known; or empty
/// @return       dO x basis.size()
Eigen::MatrixXd fit_linear(const Basis& basis, const RecordedCurve* below,
                           const Eigen::MatrixXd& data, const Eigen::VectorXd& last = {});

/// The policy whose curve is nearest to the data, and how near. Throws std::invalid_argument as
/// LinearPolicy's constructor does.
Fitted<std::shared_ptr<LinearPolicy>> fit_linear_policy(LinearFormPtr form,
                                                        const Eigen::MatrixXd& data,
                                                        const Eigen::VectorXd& last = {});

/// What every kind of linear policies asks of [policy]. Each refuses by ConfigError.
struct LinearRange {
  double low;
  double high;
};
/// "range" of a start without a demonstration.
LinearRange read_linear_range(SettingsReader& policy);
/// "values": what each output of such a start is.
std::vector<double> read_constant_outputs(SettingsReader& policy);
/// [policy.demonstration] of one input and all outputs.
Demonstration read_curve(SettingsReader& policy, const StartSources& sources);
LinearRange range_of(const Demonstration& demonstration);

/// What a study says of a linear policy.
struct LinearFormOf {
  std::string_view kind;
  /// Its form with so many coefficients of an output; null where the study has no such form.
  std::function<LinearFormPtr(int size)> of_size;
};

/// The policy that the sources have, if it is such a policy: then nothing is fitted. Else the fit.
StartPolicy linear_start(SettingsReader& policy, const StartSources& sources,
                         const Demonstration& demonstration, const LinearFormOf& form,
                         const std::function<std::shared_ptr<LinearPolicy>()>& fit);

}  // namespace treeroll
