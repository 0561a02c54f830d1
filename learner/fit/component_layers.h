#pragma once

#include "common/policy/tree/tree_model.h"

namespace treeroll {

class SettingsReader;

/// Reads a tree that is given component by component, a table a layer, coarse to fine:
///
///   [layer_1]               # a mixture, as common/mixture/mixture_settings.h reads it
///   range = [0, 2]
///   outputs = [0, 0]
///   deviations = [.354, .3]
///   [layer_2]
///   range = [0, 2]
///   outputs = [0, 0, 0, 0]
///   deviations = [.25, .3]
///   parents = [1, 1, 2, 2]  # of each component, counted from 1 in the layer above
///
/// Does not call finish() on `policy`. Throws ConfigError.
TreeModel read_component_layers(SettingsReader& policy, FrameKind frame_kind);

}  // namespace treeroll
