#include "learner/fit/spline_start.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/policy/linear/spline_form.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/linear_fit.h"
#include "learner/fit/missing_outputs.h"

namespace treeroll {
namespace {

/// A correction carries its demonstration to the workers.
constexpr Eigen::Index kRecordedMax = 2000;
const std::vector<double> kLadder = {4, 5, 7, 11};

/// The layers that a study names.
std::shared_ptr<const SplineLadder> read_ladder(SettingsReader& policy, int degree,
                                                LinearRange range,
                                                const std::vector<double>& otherwise,
                                                std::string_view default_in_words) {
  const std::vector<double> sizes =
      policy.numbers("coefficients", {.min = 1, .max = LinearPolicy::kSizeMax}, 1,
                     SplineLadder::kLayersMax, otherwise,
                     {.meaning = "Of each output, layer by layer, coarse to fine: each has twice "
                                 "the spans (coefficients - degree) of the one before",
                      .otherwise = default_in_words,
                      .rule = "each above degree, at most 256",
                      .example = "[4, 5, 7, 11]"});
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i] != std::floor(sizes[i])) policy.refuse("coefficients", "must hold integers");
    if (sizes[i] <= degree) {
      policy.refuse("coefficients",
                    fmt::format("must be at least {} with this degree", degree + 1));
    }
    if (i == 0) continue;
    const int refined = BSpline::refined_size(degree, static_cast<int>(sizes[i - 1]));
    if (sizes[i] != refined) {
      policy.refuse("coefficients",
                    fmt::format("each layer must have twice the spans of the one before: after "
                                "{:g} come {}",
                                sizes[i - 1], refined));
    }
  }
  return std::make_shared<SplineLadder>(
      BSpline(degree, static_cast<int>(sizes.front()), range.low, range.high),
      static_cast<int>(sizes.size()));
}

int read_degree(SettingsReader& policy) {
  return static_cast<int>(
      policy.integer("degree", 0, BSpline::kDegreeMax, 3,
                     {.meaning = "Of the polynomials that the spline is made of"}));
}

std::shared_ptr<LinearPolicy> fit_sufficient_spline(
    SettingsReader& policy, int degree, const std::function<LinearFormPtr(int size)>& form,
    const Eigen::MatrixXd& data) {
  const auto fit = [&](int size) { return fit_linear_policy(form(size), data); };
  try {
    return smallest_sufficient({.sizes = {degree + 1, 1, kSufficientFunctionsMax},
                                .what = "coefficients",
                                .enough = sufficient_error(data, 1)},
                               fit);
  } catch (const FitError& error) {
    policy.refuse("coefficients", error.what());
  }
}

/// Where a study says how many coefficients there are.
LinearFormOf only(const LinearFormPtr& form) {
  return {form->kind(),
          [form](int size) { return size == form->finest().size() ? form : nullptr; }};
}

}  // namespace

StartPolicy read_constant_spline(SettingsReader& policy, const std::vector<double>& sizes) {
  const int degree = read_degree(policy);
  const LinearRange range = read_linear_range(policy);
  const std::vector<double> values = read_constant_outputs(policy);
  std::vector<double> otherwise;
  for (const double cubic : sizes) otherwise.push_back(cubic - 3 + degree);
  auto ladder =
      read_ladder(policy, degree, range, otherwise,
                  fmt::format("[{}] of degree 3; of others as many spans", fmt::join(sizes, ", ")));
  Eigen::MatrixXd coefficients(values.size(), ladder->finest().size());
  for (std::size_t o = 0; o < values.size(); ++o) {
    coefficients.row(static_cast<Eigen::Index>(o)).setConstant(values[o]);
  }
  return {
      .policy = std::make_shared<LinearPolicy>(
          std::make_shared<SplineForm>(std::move(ladder), nullptr), std::move(coefficients), 1)};
}

StartPolicy read_spline_start(SettingsReader& policy, const StartSources& sources) {
  const bool is_constant =
      policy.choice(
          "start", {"fit", "constant"}, "fit",
          {.meaning =
               "A fit to a demonstration, or one number for each output and no demonstration"}) ==
      "constant";
  if (is_constant) return read_constant_spline(policy, kLadder);
  const int degree = read_degree(policy);
  const Demonstration demonstration = read_curve(policy, sources);
  const LinearRange range = range_of(demonstration);
  const Eigen::MatrixXd& data = demonstration.data;
  if (!policy.has("coefficients") ||
      policy.is_word("coefficients", "auto",
                     {.meaning = "As few as meet the demonstration, of several recordings "
                                 "their mean, within a tenth of its rms"})) {
    policy.string("coefficients", "auto",
                  {.meaning = "\"auto\": as few as meet the demonstration, of several recordings "
                              "their mean, within a tenth of its rms; or as many as a list of "
                              "integers says"});
    const auto form = [&](int size) -> LinearFormPtr {
      if (size <= degree) return nullptr;
      return std::make_shared<SplineForm>(
          std::make_shared<SplineLadder>(BSpline(degree, size, range.low, range.high), 1), nullptr);
    };
    return linear_start(policy, sources, demonstration, {"spline", form},
                        [&] { return fit_sufficient_spline(policy, degree, form, data); });
  }
  const LinearFormPtr form =
      std::make_shared<SplineForm>(read_ladder(policy, degree, range, {}, "\"auto\""), nullptr);
  return linear_start(policy, sources, demonstration, only(form),
                      [&] { return fit_linear_policy(form, data).start; });
}

bool can_be_corrected(const Demonstration& demonstration) {
  const Eigen::MatrixXd& data = demonstration.data;
  if (demonstration.input_dim != 1 || data.cols() > kRecordedMax || !is_complete(data))
    return false;
  for (Eigen::Index n = 1; n < data.cols(); ++n) {
    if (!(data(0, n) > data(0, n - 1))) return false;
  }
  return true;
}

StartPolicy read_correction_start(SettingsReader& policy, const StartSources& sources) {
  const int degree = read_degree(policy);
  const Demonstration demonstration = read_curve(policy, sources);
  const Eigen::MatrixXd& data = demonstration.data;
  if (data.cols() > kRecordedMax) {
    policy.refuse("demonstration",
                  fmt::format("has {} samples: a correction carries them, and takes at most {}; or "
                              "take kind = \"spline\"",
                              data.cols(), kRecordedMax));
  }
  auto ladder =
      read_ladder(policy, degree, range_of(demonstration), {static_cast<double>(5 + degree)},
                  "[8] of degree 3; of others as many spans");
  RecordedCurvePtr recorded;
  try {
    const Eigen::RowVectorXd inputs = data.row(0);
    recorded = std::make_shared<RecordedCurve>(std::vector<double>(inputs.begin(), inputs.end()),
                                               data.bottomRows(data.rows() - 1));
  } catch (const std::invalid_argument& error) {
    policy.refuse("demonstration",
                  fmt::format("cannot be corrected: {}; kind = \"spline\" fits several recordings",
                              error.what()));
  }
  Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(data.rows() - 1, ladder->finest().size());
  const LinearFormPtr form = std::make_shared<SplineForm>(std::move(ladder), std::move(recorded));
  return linear_start(policy, sources, demonstration, only(form),
                      [&] { return std::make_shared<LinearPolicy>(form, std::move(nothing), 1); });
}

}  // namespace treeroll
