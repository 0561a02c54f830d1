#include "learner/fit/component_layers.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/mixture/mixture_settings.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

constexpr int kLayersMax = 8;

/// Indices in the layer above.
std::vector<int> read_parents(SettingsReader& layer, std::size_t count, int count_above) {
  std::vector<int> parents;
  for (const double parent : layer.numbers(
           "parents", {.min = 1, .max = static_cast<double>(count_above)}, count, count, {},
           {.meaning =
                "From layer_2 on: the parent of each component, counted from 1 in the layer above",
           .rule = "one for each component",
           .example = "[1]"})) {
    if (parent != std::floor(parent)) layer.refuse("parents", "must hold integers");
    parents.push_back(static_cast<int>(parent) - 1);
  }
  return parents;
}

}  // namespace

TreeModel read_component_layers(SettingsReader& policy, FrameKind frame_kind) {
  std::vector<Gmm> layers;
  std::vector<std::vector<int>> parents;
  for (int number = 1; number <= kLayersMax; ++number) {
    const std::string key = fmt::format("layer_{}", number);
    if (number > 1 && !policy.has(key)) break;
    SettingsReader table = policy.table(key);
    Gmm layer = read_mixture(table);
    parents.emplace_back();
    if (number > 1) {
      parents.back() = read_parents(table, static_cast<std::size_t>(layer.num_components()),
                                    layers.back().num_components());
    }
    table.finish();
    layers.push_back(std::move(layer));
  }
  try {
    return TreeModel::from_global(frame_kind, std::move(layers), std::move(parents));
  } catch (const std::invalid_argument& error) {
    policy.refuse("layer_1", fmt::format("gives no tree: {}", error.what()));
  }
}

}  // namespace treeroll
