#include "learner/fit/fit_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "learner/fit/kmeans.h"
#include "learner/fit/missing_outputs.h"

namespace treeroll {
namespace {

Gmm in_order_of_first_input(const Gmm& gmm) {
  std::vector<Component> components = gmm.components();
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.mean[0] < b.mean[0]; });
  return Gmm(gmm.input_dim(), std::move(components));
}

Gmm refined(const Gmm& gmm, const Eigen::MatrixXd& data, const FitSettings& settings) {
  return settings.refine ? refine_regression(gmm, data, *settings.refine) : gmm;
}

Gmm fit_layer(const Eigen::MatrixXd& data, int num_components, const FitSettings& settings) {
  try {
    const Gmm start = settings.start == FitStart::kKmeans
                          ? kmeans(data, settings.input_dim, num_components, settings.kmeans_seed,
                                   settings.em.regularisation)
                          : equally_spaced(data, settings.input_dim, num_components,
                                           settings.initial_output_deviation);
    const Gmm fitted = fit_em(start, data, settings.em);
    if (!settings.refine) return fitted;
    return in_order_of_first_input(refined(in_order_of_first_input(fitted), data, settings));
  } catch (const LeftWithoutData& error) {
    // Clusters need every output.
    if (settings.start == FitStart::kKmeans || !is_complete(data)) throw;
    throw FitError(
        fmt::format("{}; with policy.fit.start = \"kmeans\" every component begins with "
                    "data of its own",
                    error.what()));
  } catch (const std::invalid_argument& error) {
    throw FitError(error.what());
  }
}

/// Of a layer that is split from the one above.
[[noreturn]] void refuse_layer(std::size_t layer, const char* fault) {
  throw FitError(
      fmt::format("layer {}: {}; policy.model = \"top_down_tree\" or \"flat\" splits no component",
                  layer, fault));
}

/// Every Gaussian of the layer above has two children, beside each other.
std::vector<int> parents_of_pairs(int num_children) {
  std::vector<int> parents;
  for (int k = 0; k < num_children; ++k) parents.push_back(k / 2);
  return parents;
}

/// P(component | x_n) down the whole chain of ancestors: siblings compete for what their parent
/// has.
Eigen::MatrixXd responsibilities_below(const std::vector<Component>& components,
                                       const Eigen::MatrixXd& of_parents,
                                       const Eigen::MatrixXd& data, int input_dim) {
  Eigen::MatrixXd here(2 * of_parents.rows(), data.cols());
  for (Eigen::Index p = 0; p < of_parents.rows(); ++p) {
    const auto first = components.begin() + 2 * p;
    const Eigen::MatrixXd among_siblings =
        responsibilities(Gmm(input_dim, {first[0], first[1]}), data);
    for (Eigen::Index k = 0; k < 2; ++k) {
      here.row(2 * p + k) = among_siblings.row(k).cwiseProduct(of_parents.row(p));
    }
  }
  return here;
}

/// Whether some component has less than one sample's worth of the data.
bool leaves_one_without_data(const Eigen::MatrixXd& responsibilities) {
  return responsibilities.rowwise().sum().minCoeff() < 1;
}

/// The samples as a regression's weights see them: outputs do not count.
Eigen::MatrixXd inputs_alone(Eigen::MatrixXd data, int input_dim) {
  data.bottomRows(data.rows() - input_dim).setConstant(std::numeric_limits<double>::quiet_NaN());
  return data;
}

/// A refined layer may meet the data by components that cancel one another, far from all samples:
/// by their density one of them then has all data, and the children of another none. Who has a
/// share in the regression there has it by the inputs.
/// @param of  data -> responsibilities of the layer's components
template <typename Of>
Eigen::MatrixXd shares_of_data(const Of& of, const Eigen::MatrixXd& data,
                               const FitSettings& settings) {
  Eigen::MatrixXd shares = of(data);
  if (!settings.refine || !leaves_one_without_data(shares)) return shares;
  return of(inputs_alone(data, settings.input_dim));
}

}  // namespace

TreeModel fit_flat(const Eigen::MatrixXd& data, int num_components, const FitSettings& settings) {
  return TreeModel::from_global(settings.frame_kind, {fit_layer(data, num_components, settings)},
                                {{}});
}

TreeModel fit_bottom_up(const Eigen::MatrixXd& data, int num_components_layer_1, int num_layers,
                        const FitSettings& settings) {
  std::vector<Gmm> layers = {fit_layer(data, num_components_layer_1, settings)};
  std::vector<std::vector<int>> parents = {{}};
  Eigen::MatrixXd parent_responsibilities = shares_of_data(  // K x N
      [&](const Eigen::MatrixXd& samples) { return responsibilities(layers[0], samples); }, data,
      settings);
  while (static_cast<int>(layers.size()) < num_layers) {
    const Gmm& above = layers.back();
    std::vector<Component> components;
    try {
      for (int p = 0; p < above.num_components(); ++p) {
        auto [first, second] = split(above[p], settings.split);
        const Gmm start(settings.input_dim, {std::move(first), std::move(second)});
        const Gmm pair =
            fit_children(start, data, parent_responsibilities.row(p).transpose(), settings.em);
        components.insert(components.end(), pair.components().begin(), pair.components().end());
      }
      // All pairs at once, since a regression mixes them all: alone, each would leave an error
      // where it meets the next.
      components =
          refined(Gmm(settings.input_dim, std::move(components)), data, settings).components();
    } catch (const std::runtime_error& error) {
      refuse_layer(layers.size() + 1, error.what());
    } catch (const std::invalid_argument& error) {
      refuse_layer(layers.size() + 1, error.what());
    }
    parent_responsibilities = shares_of_data(
        [&](const Eigen::MatrixXd& samples) {
          return responsibilities_below(components, parent_responsibilities, samples,
                                        settings.input_dim);
        },
        data, settings);
    parents.push_back(parents_of_pairs(static_cast<int>(components.size())));
    layers.emplace_back(settings.input_dim, std::move(components));
  }
  return TreeModel::from_global(settings.frame_kind, std::move(layers), std::move(parents));
}

TreeModel fit_top_down(const Eigen::MatrixXd& data, int num_components_finest, int num_layers,
                       const FitSettings& settings) {
  std::vector<Gmm> layers = {
      in_order_of_first_input(fit_layer(data, num_components_finest, settings))};
  std::vector<Component> components = layers[0].components();
  std::vector<std::vector<int>> parents;
  while (static_cast<int>(layers.size()) < num_layers) {
    CHECK(components.size() % 2 == 0, "components are merged in pairs");
    std::vector<Component> merged;
    for (std::size_t k = 0; k < components.size(); k += 2) {
      merged.push_back(merge(components[k], components[k + 1]));
    }
    parents.insert(parents.begin(), parents_of_pairs(static_cast<int>(components.size())));
    components = std::move(merged);
    layers.emplace(layers.begin(), settings.input_dim, components);
  }
  parents.insert(parents.begin(), std::vector<int>());
  return TreeModel::from_global(settings.frame_kind, std::move(layers), std::move(parents));
}

}  // namespace treeroll
