#include "learner/fit/start_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/tree/tree_policy.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/automatic_start.h"
#include "learner/fit/basis_start.h"
#include "learner/fit/component_layers.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/ds_gmr_start.h"
#include "learner/fit/fit_tree.h"
#include "learner/fit/fit_work.h"
#include "learner/fit/missing_outputs.h"
#include "learner/fit/network_start.h"
#include "learner/fit/spline_start.h"
#include "learner/fit/sufficient.h"

namespace treeroll {
namespace {

constexpr std::size_t kFitLayersMax = 8;
/// How far components = "auto" looks.
constexpr int kSufficientComponentsMax = 16;
/// Studies of an earlier form had no refinement.
constexpr int kFirstRefinedForm = 3;

/// @param demonstration  what suits its units is the default
/// @param form           of the study that the settings are from
FitSettings read_fit(SettingsReader reader, const Demonstration& demonstration, int form) {
  FitSettings settings;
  settings.input_dim = demonstration.input_dim;
  settings.em.num_iterations = static_cast<int>(
      reader.integer("iterations", 0, 100000, settings.em.num_iterations,
                     {.meaning = "Of expectation maximisation, for each layer; components x "
                                 "samples x iterations are at most 1e9"}));
  const Eigen::VectorXd& standard = demonstration.regularisation;
  const auto dim = static_cast<std::size_t>(standard.size());
  const std::vector<double> regularisation = reader.numbers(
      "regularisation", {.min = 0, .max = 1e50}, dim, dim,
      std::vector<double>(standard.begin(), standard.end()),
      {.meaning = "A variance for each input and output, added in each M step; above 0 for an "
                  "output that does not vary",
       .otherwise =
           "[0.001, 1.0] of the cart's acceleration; of files 1e-4 of each column's variance",
       .rule = "one for each input and output, each 0 to 1e50"});
  settings.em.regularisation =
      Eigen::Map<const Eigen::VectorXd>(regularisation.data(), standard.size());
  const Eigen::VectorXd outputs =
      settings.em.regularisation.tail(standard.size() - settings.input_dim);
  for (Eigen::Index i = 0; i < outputs.size(); ++i) {
    if (outputs[i] > 0 || demonstration.output_varies(i)) continue;
    reader.refuse(
        "regularisation",
        fmt::format("output {} of the demonstration does not vary: its variance, number {} "
                    "here, must be above 0",
                    i + 1, settings.input_dim + i + 1));
  }
  if (reader.choice("start", {"equally_spaced", "kmeans"}, "equally_spaced",
                    {.meaning = "Where expectation maximisation begins: components over equal "
                                "parts of the first input, or clusters of the data"}) == "kmeans") {
    settings.start = FitStart::kKmeans;
    if (!is_complete(demonstration.data)) {
      reader.refuse("start",
                    "of clusters needs all outputs of the demonstration: some are missing");
    }
    settings.kmeans_seed = static_cast<std::uint64_t>(
        reader.integer("kmeans_seed", 0, 1'000'000'000, 1,
                       {.meaning = "Of the random numbers that seed the clusters"}));
  } else {
    const double suited = demonstration.output_deviation > 0 ? demonstration.output_deviation
                                                             : std::sqrt(outputs.maxCoeff());
    settings.initial_output_deviation = reader.number(
        "initial_output_deviation", {.min = 1e-20, .max = 1e20}, suited,
        {.meaning = "zeta_2 of the components that expectation maximisation begins with",
         .unit = "the output's unit",
         .otherwise = "5 of the cart's acceleration; of files the largest deviation of a column "
                      "but the first, or the root of the regularisation where none varies"});
  }
  settings.split.axis =
      reader.choice("split_axis", {"cholesky", "principal"}, "cholesky",
                    {.meaning = "Along which axis of a component its two children of the next "
                                "layer lie, (3-6); counts for model = \"tree\""}) == "principal"
          ? SplitAxis::kPrincipal
          : SplitAxis::kCholesky;
  const char* otherwise = form < kFirstRefinedForm ? "none" : "regression";
  if (reader.choice("refine", {"regression", "none"}, otherwise,
                    {.meaning = "Whether the fit goes on until its regression meets the "
                                "demonstration; \"none\" is expectation maximisation alone, as in "
                                "the thesis. samples x outputs x numbers^2 are at most 2e8"}) ==
      "regression") {
    settings.refine.emplace();
    settings.refine->stop_relative_error = reader.number(
        "stop_relative_error", {.min = 0, .max = 1}, settings.refine->stop_relative_error,
        {.meaning = "Where the refinement stops: the error as a share of the outputs' rms"});
  }
  reader.finish();
  return settings;
}

/// Number of components a layer, coarse to fine.
std::vector<int> read_components(SettingsReader& policy, bool is_flat, Eigen::Index num_samples) {
  const std::vector<double> numbers = policy.numbers(
      "components", {.min = 1, .max = kComponentsMax}, 1, kFitLayersMax, std::vector<double>{2, 4},
      {.meaning = "Components of each layer, coarse to fine: of a tree each twice the one before; "
                  "\"flat\" uses the last. The last is at most the number of samples",
       .example = "[2, 4]"});
  std::vector<int> components;
  for (const double number : numbers) {
    if (number != std::floor(number)) policy.refuse("components", "must hold integers");
    components.push_back(static_cast<int>(number));
  }
  for (std::size_t i = 1; i < components.size() && !is_flat; ++i) {
    if (components[i] != 2 * components[i - 1]) {
      policy.refuse("components", "of a tree: each layer must hold twice as many as the one above");
    }
  }
  if (components.back() > num_samples) {
    policy.refuse(
        "components",
        fmt::format("there must not be more than the demonstration's {} samples", num_samples));
  }
  return components;
}

ThetaLayout read_layout(SettingsReader& policy) {
  const std::string word = policy.choice(
      "layout",
      {kThetaLayoutNames[0], kThetaLayoutNames[1], kThetaLayoutNames[2], kThetaLayoutNames[3],
       kThetaLayoutNames[4]},
      "means_cholesky",
      {.meaning = "What is explored, the numbers of each component that theta holds: its means, "
                  "and its couplings of input and output in a parameterisation"});
  std::size_t index = 0;
  while (kThetaLayoutNames[index] != word) ++index;
  return static_cast<ThetaLayout>(index);
}

std::vector<double> log_likelihoods(const TreeModel& tree, const Eigen::MatrixXd& data) {
  std::vector<double> by_layer;
  for (int layer = 1; layer <= tree.num_layers(); ++layer) {
    by_layer.push_back(mean_log_likelihood(tree.layer(layer), data));
  }
  return by_layer;
}

/// A start that was fitted before and comes from outside: is it one that these settings describe?
/// @param components  of each layer; empty where the fit has counted them
void check_fitted(SettingsReader& policy, const StartPolicy& fitted, const FitSettings& fit,
                  ThetaLayout layout, const std::vector<int>& components, Eigen::Index dim) {
  const auto* tree_policy = dynamic_cast<const TreePolicy*>(fitted.policy.get());
  const auto require = [&](bool holds, const char* what) {
    if (holds) return;
    policy.refuse("fit",
                  fmt::format("the study's stored start is another one: its {} differs", what));
  };
  require(tree_policy != nullptr, "kind");
  const TreeModel& tree = tree_policy->tree();
  require(tree_policy->layer() == 1, "explored layer");
  require(tree_policy->layout() == layout, "layout");
  require(tree.frame_kind() == fit.frame_kind, "kind of frames");
  require(tree.input_dim() == fit.input_dim && tree.dim() == dim, "number of inputs or outputs");
  const auto num_layers = static_cast<std::size_t>(tree.num_layers());
  require(components.empty() || num_layers == components.size(), "number of layers");
  for (std::size_t i = 0; i < components.size(); ++i) {
    require(tree.num_components(static_cast<int>(i) + 1) == components[i], "number of components");
  }
  require(fitted.log_likelihoods.size() == num_layers, "number of log-likelihoods");
}

/// What components = "auto" tries: a flat model of 1, 2, ..., or a tree of 1 over 2, 2 over 4, ...
SizeRange sizes_to_try(bool is_flat, Eigen::Index num_samples) {
  const int step = is_flat ? 1 : 2;
  return {step, step,
          static_cast<int>(std::min<Eigen::Index>(kSufficientComponentsMax, num_samples))};
}

void check_work(SettingsReader& policy, const FitWork& work, int components) {
  const std::optional<FitWork::TooMuch> refusal = work.refusal(components);
  if (refusal) policy.refuse(refusal->key, refusal->reason);
}

/// components = "auto". As many sizes are tried as the work allows: most demonstrations are met by
/// one of the first.
/// @param fitted  numbers of components, layer by layer -> TreeModel
template <typename Fit>
TreeModel smallest_tree(SizeRange sizes, const FitWork& work, const Eigen::MatrixXd& data,
                        int input_dim, const Fit& fitted) {
  SizeSearch search{
      .sizes = sizes, .what = "components", .enough = sufficient_error(data, input_dim)};
  search.sizes.most = work.last_of(sizes);
  if (search.sizes.most + sizes.step <= sizes.most) {
    search.way_out = fmt::format(
        "to try more takes too long with so many samples: say how many "
        "there are to be, at most {}",
        work.most_alone());
  }
  return smallest_sufficient(search, [&](int finest) {
    const bool is_flat = sizes.step == 1;
    TreeModel candidate =
        fitted(is_flat ? std::vector<int>{finest} : std::vector<int>{finest / 2, finest});
    const double error = relative_regression_error(candidate.finest(), data);
    return Fitted<TreeModel>{std::move(candidate), error};
  });
}

StartPolicy fit_demonstration(SettingsReader& policy, FrameKind frame_kind, ThetaLayout layout,
                              const StartSources& sources,
                              const std::function<void(Demonstration&)>& change) {
  const std::string model = policy.choice(
      "model", {"tree", "flat", "top_down_tree"}, "tree",
      {.meaning =
           "\"tree\": fitted coarse to fine, each layer split from the one above; \"flat\": the "
           "finest layer alone; \"top_down_tree\": the finest layer is fitted and merged"});
  Demonstration demonstration = read_demonstration(policy.table("demonstration"), sources);
  StartPolicy start{.policy = {},
                    .log_likelihoods = {},
                    .demonstration = std::make_shared<const Eigen::MatrixXd>(demonstration.data),
                    .demonstration_text = demonstration.text};
  change(demonstration);
  const Eigen::MatrixXd& data = demonstration.data;
  FitSettings fit = read_fit(policy.table("fit"), demonstration, sources.form);
  fit.frame_kind = frame_kind;
  const bool is_flat = model == "flat";
  const bool is_automatic = policy.is_word(
      "components", "auto",
      {.meaning = "As few components as meet the demonstration, of several recordings their mean, "
                  "within a tenth of its rms, at most 16; of a tree two layers of them; needs "
                  "fit.refine = \"regression\""});
  if (is_automatic && !fit.refine) {
    policy.refuse("components",
                  "\"auto\" needs fit.refine = \"regression\"; or say how many, [2, 4] say");
  }
  std::vector<int> components;
  if (!is_automatic) components = read_components(policy, is_flat, data.cols());
  if (!is_automatic && is_flat) components = {components.back()};
  if (sources.fitted) {
    check_fitted(policy, *sources.fitted, fit, layout, components, data.rows());
    start.policy = sources.fitted->policy;
    start.log_likelihoods = sources.fitted->log_likelihoods;
    return start;
  }
  const auto fitted = [&](const std::vector<int>& layers) {
    const int num_layers = static_cast<int>(layers.size());
    return is_flat           ? fit_flat(data, layers.back(), fit)
           : model == "tree" ? fit_bottom_up(data, layers.front(), num_layers, fit)
                             : fit_top_down(data, layers.back(), num_layers, fit);
  };
  const FitWork work(data, fit);
  const SizeRange sizes = sizes_to_try(is_flat, data.cols());
  check_work(policy, work, is_automatic ? sizes.first : components.back());
  try {
    const TreeModel tree =
        is_automatic ? smallest_tree(sizes, work, data, fit.input_dim, fitted) : fitted(components);
    start.log_likelihoods = log_likelihoods(tree, data);
    start.policy = std::make_shared<TreePolicy>(tree, 1, layout);
    return start;
  } catch (const FitError& error) {
    policy.refuse("fit", fmt::format("no model can be fitted: {}", error.what()));
  } catch (const std::invalid_argument& error) {
    policy.refuse("fit", fmt::format("no model can be fitted: {}", error.what()));
  }
}

TreeModel given_components(SettingsReader& policy, FrameKind frame_kind) {
  const std::string model = policy.choice("model", {"tree", "flat"}, "tree",
                                          {.meaning = "All layers, or the finest alone"});
  TreeModel tree = read_component_layers(policy, frame_kind);
  return model == "tree" ? tree : TreeModel::from_global(frame_kind, {tree.finest()}, {{}});
}

}  // namespace

StartPolicy read_start_policy(SettingsReader& policy, const StartSources& sources) {
  return read_tree_start(policy, sources, [](Demonstration&) {});
}

StartPolicy read_tree_start(SettingsReader& policy, const StartSources& sources,
                            const std::function<void(Demonstration&)>& change) {
  const bool is_given =
      policy.choice(
          "start", {"fit", "components"}, "fit",
          {.meaning =
               "Where the policy comes from: a fit to a demonstration, or component by component "
               "from the tables layer_1, layer_2 and so on, at most 8, coarse to fine"}) ==
      "components";
  const ThetaLayout layout = read_layout(policy);
  const FrameKind frame_kind =
      policy.choice(
          "frames", {"eigenvector", "cholesky"}, "eigenvector",
          {.meaning = "In which frame of its parent a component of a finer layer is held"}) ==
              "cholesky"
          ? FrameKind::kCholesky
          : FrameKind::kEigenvector;
  if (!is_given) return fit_demonstration(policy, frame_kind, layout, sources, change);
  return {.policy = std::make_shared<TreePolicy>(given_components(policy, frame_kind), 1, layout)};
}

PolicyRegistry learnable_policies() {
  PolicyRegistry policies = standard_policies();
  policies.set_start("tree", read_start_policy);
  policies.set_start("spline", read_spline_start);
  policies.set_start("correction", read_correction_start);
  policies.set_start("rbf", read_rbf_start);
  policies.set_start("dmp", read_dmp_start);
  policies.set_start("ds_gmr", read_ds_gmr_start);
  policies.set_start("network", read_network_start);
  policies.add_choice("auto", read_automatic_start);
  return policies;
}

}  // namespace treeroll
