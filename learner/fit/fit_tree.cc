#include "learner/fit/fit_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "learner/fit/kmeans.h"

namespace treeroll {
namespace {

Gmm fit_layer(const Eigen::MatrixXd& data, int num_components, const FitSettings& settings) {
  try {
    const Gmm start = settings.start == FitStart::kKmeans
                          ? kmeans(data, settings.input_dim, num_components, settings.kmeans_seed,
                                   settings.em.regularisation)
                          : equally_spaced(data, settings.input_dim, num_components,
                                           settings.initial_output_deviation);
    return fit_em(start, data, settings.em);
  } catch (const FitError& error) {
    if (settings.start == FitStart::kKmeans) throw;
    throw FitError(
        fmt::format("{}; with policy.fit.start = \"kmeans\" every component begins with "
                    "data of its own",
                    error.what()));
  } catch (const std::invalid_argument& error) {
    throw FitError(error.what());
  }
}

/// Every Gaussian of the layer above has two children, beside each other.
std::vector<int> parents_of_pairs(int num_children) {
  std::vector<int> parents;
  for (int k = 0; k < num_children; ++k) parents.push_back(k / 2);
  return parents;
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
  Eigen::MatrixXd parent_responsibilities = responsibilities(layers[0], data);  // K x N
  while (static_cast<int>(layers.size()) < num_layers) {
    const Gmm& above = layers.back();
    std::vector<Component> components;
    Eigen::MatrixXd here(2 * above.num_components(), data.cols());
    for (int p = 0; p < above.num_components(); ++p) {
      const Eigen::VectorXd of_parent = parent_responsibilities.row(p);
      try {
        auto [first, second] = split(above[p], settings.split);
        const Gmm start(settings.input_dim, {std::move(first), std::move(second)});
        const Gmm pair = fit_children(start, data, of_parent, settings.em);
        const Eigen::MatrixXd among_siblings = responsibilities(pair, data);
        for (int k = 0; k < 2; ++k) {
          here.row(2 * p + k) = among_siblings.row(k).cwiseProduct(of_parent.transpose());
          components.push_back(pair[k]);
        }
      } catch (const std::invalid_argument& error) {
        throw FitError(error.what());
      }
    }
    parents.push_back(parents_of_pairs(static_cast<int>(components.size())));
    layers.emplace_back(settings.input_dim, std::move(components));
    parent_responsibilities = std::move(here);
  }
  return TreeModel::from_global(settings.frame_kind, std::move(layers), std::move(parents));
}

TreeModel fit_top_down(const Eigen::MatrixXd& data, int num_components_finest, int num_layers,
                       const FitSettings& settings) {
  std::vector<Component> components = fit_layer(data, num_components_finest, settings).components();
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.mean[0] < b.mean[0]; });
  std::vector<Gmm> layers = {Gmm(settings.input_dim, components)};
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
