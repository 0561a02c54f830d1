#include "learner/fit/spline_start.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/base/settings_reader.h"
#include "common/policy/linear/spline_policy.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/missing_outputs.h"
#include "learner/fit/regression_fit.h"

namespace treeroll {
namespace {

constexpr double kRidge = 1e-9;
/// How far coefficients = "auto" looks.
constexpr int kSufficientMax = 64;
/// A correction carries its demonstration to the workers.
constexpr Eigen::Index kRecordedMax = 2000;
const std::vector<double> kLadder = {4, 5, 7, 11};

/// rms of the curve's error, each output divided by its own rms.
double relative_error(const BSpline& spline, const Eigen::MatrixXd& coefficients,
                      const Eigen::MatrixXd& data) {
  const Eigen::RowVectorXd inputs = data.row(0);
  const Eigen::MatrixXd curve =
      spline.matrix({inputs.data(), static_cast<std::size_t>(inputs.size())}) *
      coefficients.transpose();
  double sum = 0;
  for (Eigen::Index o = 0; o < curve.cols(); ++o) {
    const Eigen::VectorXd wanted = data.row(o + 1);
    const double own = wanted.squaredNorm();
    sum += (curve.col(o) - wanted).squaredNorm() /
           (own > 0 ? own : static_cast<double>(wanted.size()));
  }
  return std::sqrt(sum / static_cast<double>(curve.cols()));
}

struct Range {
  double low;
  double high;
};

/// The layers that a study names.
std::shared_ptr<const SplineLadder> read_ladder(SettingsReader& policy, int degree, Range range,
                                                const std::vector<double>& otherwise,
                                                std::string_view default_in_words) {
  const std::vector<double> sizes =
      policy.numbers("coefficients", {.min = 1, .max = SplineLadder::kSizeMax}, 1,
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
    if (i > 0 && sizes[i] - degree != 2 * (sizes[i - 1] - degree)) {
      policy.refuse(
          "coefficients",
          fmt::format("each layer must have twice the spans of the one before: after {:g} "
                      "come {:g}",
                      sizes[i - 1], 2 * (sizes[i - 1] - degree) + degree));
    }
  }
  return std::make_shared<SplineLadder>(
      BSpline(degree, static_cast<int>(sizes.front()), range.low, range.high),
      static_cast<int>(sizes.size()));
}

int sufficient_size(SettingsReader& policy, int degree, Range range, const Eigen::MatrixXd& data) {
  double least = std::numeric_limits<double>::infinity();
  for (int size = degree + 1; size <= kSufficientMax; ++size) {
    const BSpline spline(degree, size, range.low, range.high);
    const double error = relative_error(spline, fit_spline(spline, data), data);
    if (error <= kSufficientError) return size;
    least = std::min(least, error);
  }
  policy.refuse("coefficients",
                fmt::format("of up to {} coefficients none come within {} of the demonstration's "
                            "rms, the best within {:.2g}: say how many there are to be",
                            kSufficientMax, kSufficientError, least));
}

int read_degree(SettingsReader& policy) {
  return static_cast<int>(
      policy.integer("degree", 0, BSpline::kDegreeMax, 3,
                     {.meaning = "Of the polynomials that the spline is made of"}));
}

/// A demonstration of one input.
Demonstration read_curve(SettingsReader& policy, const StartSources& sources) {
  Demonstration demonstration = read_demonstration(policy.table("demonstration"), sources);
  if (demonstration.input_dim != 1) {
    policy.refuse("demonstration", "of this kind of policy must have one input");
  }
  if (!is_complete(demonstration.data)) {
    policy.refuse("demonstration",
                  "of this kind of policy must have all outputs: some are missing");
  }
  return demonstration;
}

Range range_of(const Eigen::MatrixXd& data) {
  return {data.row(0).minCoeff(), data.row(0).maxCoeff()};
}

StartPolicy start_from(SettingsReader& policy, const StartSources& sources,
                       const Demonstration& demonstration, std::shared_ptr<SplinePolicy> fitted) {
  StartPolicy start{.policy = std::move(fitted),
                    .log_likelihoods = {},
                    .demonstration = std::make_shared<const Eigen::MatrixXd>(demonstration.data),
                    .demonstration_text = demonstration.text};
  if (!sources.fitted) return start;
  const auto* known = dynamic_cast<const SplinePolicy*>(sources.fitted->policy.get());
  const auto& own = dynamic_cast<const SplinePolicy&>(*start.policy);
  const auto require = [&](bool holds, const char* what) {
    if (holds) return;
    policy.refuse("demonstration",
                  fmt::format("the study's stored start is another one: its {} differs", what));
  };
  require(known != nullptr && known->kind() == own.kind(), "kind");
  require(known->layer() == 1, "explored layer");
  require(known->num_layers() == own.num_layers() &&
              known->coefficients().rows() == own.coefficients().rows() &&
              known->ladder().finest().knots() == own.ladder().finest().knots(),
          "number of coefficients, layers or outputs");
  start.policy = sources.fitted->policy;
  return start;
}

StartPolicy constant_start(SettingsReader& policy, int degree) {
  constexpr std::size_t kOutputsMax = 32;
  const std::vector<double> ends = policy.numbers(
      "range", kAnyNumber, 2, 2, {},
      {.meaning = "The inputs that the spline is over, first and last", .example = "[0.0, 2.0]"});
  if (!(ends[0] < ends[1]) || !std::isfinite(ends[1] - ends[0])) {
    policy.refuse("range", "must begin before it ends");
  }
  const std::vector<double> values =
      policy.numbers("values", {.min = -1e50, .max = 1e50}, 1, kOutputsMax, std::vector<double>{0},
                     {.meaning = "What each output begins with"});
  std::vector<double> otherwise;
  for (const double cubic : kLadder) otherwise.push_back(cubic - 3 + degree);
  const auto ladder = read_ladder(policy, degree, {ends[0], ends[1]}, otherwise,
                                  "[4, 5, 7, 11] of degree 3; of others as many spans");
  Eigen::MatrixXd coefficients(values.size(), ladder->finest().size());
  for (std::size_t o = 0; o < values.size(); ++o) {
    coefficients.row(static_cast<Eigen::Index>(o)).setConstant(values[o]);
  }
  return {.policy = std::make_shared<SplinePolicy>(ladder, nullptr, std::move(coefficients), 1)};
}

}  // namespace

Eigen::MatrixXd fit_spline(const BSpline& spline, const Eigen::MatrixXd& data) {
  const Eigen::Index size = spline.size();
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(size, size);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(size, data.rows() - 1);
  std::array<double, BSpline::kDegreeMax + 1> values{};
  // Sums are written out, sample by sample: the same bits on every machine.
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    const int first = spline.values(data(0, n), values);
    for (int i = 0; i <= spline.degree(); ++i) {
      const double value = values[static_cast<std::size_t>(i)];
      for (int j = 0; j <= spline.degree(); ++j) {
        squares(first + i, first + j) += value * values[static_cast<std::size_t>(j)];
      }
      for (Eigen::Index o = 0; o < products.cols(); ++o) {
        products(first + i, o) += value * data(o + 1, n);
      }
    }
  }
  squares.diagonal().array() += kRidge * squares.trace() / static_cast<double>(size);
  return squares.llt().solve(products).transpose();
}

StartPolicy read_spline_start(SettingsReader& policy, const StartSources& sources) {
  const bool is_constant =
      policy.choice(
          "start", {"fit", "constant"}, "fit",
          {.meaning =
               "A fit to a demonstration, or one number for each output and no demonstration"}) ==
      "constant";
  const int degree = read_degree(policy);
  if (is_constant) return constant_start(policy, degree);
  const Demonstration demonstration = read_curve(policy, sources);
  const Eigen::MatrixXd& data = demonstration.data;
  const Range range = range_of(data);
  std::shared_ptr<const SplineLadder> ladder;
  if (!policy.has("coefficients") ||
      policy.is_word("coefficients", "auto",
                     {.meaning = "As few as meet the demonstration within a tenth of its rms"})) {
    policy.string("coefficients", "auto",
                  {.meaning = "\"auto\": as few as meet the demonstration within a tenth of its "
                              "rms; or as many as a list of integers says"});
    const int size = sufficient_size(policy, degree, range, data);
    ladder = std::make_shared<SplineLadder>(BSpline(degree, size, range.low, range.high), 1);
  } else {
    ladder = read_ladder(policy, degree, range, {}, "\"auto\"");
  }
  Eigen::MatrixXd coefficients = fit_spline(ladder->finest(), data);
  return start_from(
      policy, sources, demonstration,
      std::make_shared<SplinePolicy>(std::move(ladder), nullptr, std::move(coefficients), 1));
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
  const auto ladder = read_ladder(policy, degree, range_of(data), {static_cast<double>(5 + degree)},
                                  "[8] of degree 3; of others as many spans");
  try {
    const Eigen::RowVectorXd inputs = data.row(0);
    auto recorded = std::make_shared<RecordedCurve>(
        std::vector<double>(inputs.begin(), inputs.end()), data.bottomRows(data.rows() - 1));
    Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(data.rows() - 1, ladder->finest().size());
    return start_from(
        policy, sources, demonstration,
        std::make_shared<SplinePolicy>(ladder, std::move(recorded), std::move(nothing), 1));
  } catch (const std::invalid_argument& error) {
    policy.refuse("demonstration",
                  fmt::format("cannot be corrected: {}; kind = \"spline\" fits several recordings",
                              error.what()));
  }
}

}  // namespace treeroll
