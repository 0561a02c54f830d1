#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/policy/gmm.h"

namespace treeroll {

/// How a parent Gaussian spans the frame its children live in.
enum class FrameKind {
  kEigenvector,  ///< thesis (3-1): p_global = mean + V p. Sign of each axis by continuity.
  kCholesky,     ///< p_global = mean + L p, L the lower Cholesky factor of the covariance
};

/// A policy at several resolutions, coarse (layer 1) to fine (layer L): thesis section 3-1.
/// Every component below layer 1 has a parent in the layer above and is stored in its parent's
/// frame (3-2)..(3-5), so that moving a Gaussian moves all its descendants rigidly. Immutable.
class TreeModel {
 public:
  /// A Gaussian of the tree, in its parent's frame (layer 1: in the global frame).
  struct Node {
    int parent = -1;  ///< index in the layer above; -1 in layer 1
    Component local;
  };

  /// Layers in the global frame, coarse to fine, with the parents of each component (empty for
  /// layer 1). Throws std::invalid_argument on what Gmm refuses, on differing dimensions and on a
  /// parent index outside its layer.
  static TreeModel from_global(FrameKind frame_kind, std::vector<Gmm> layers,
                               std::vector<std::vector<int>> parents);

  int num_layers() const;
  int input_dim() const;
  FrameKind frame_kind() const;
  const std::vector<int>& parents(int layer) const;

  /// Layer 1 .. L in the global frame, (3-4).
  Gmm layer(int layer) const;
  Gmm finest() const { return layer(num_layers()); }

  /// This tree with layer `layer` replaced by `gmm` (global frame, as many components): layers
  /// above stay, descendants move rigidly with their ancestors.
  TreeModel with_layer(int layer, const Gmm& gmm) const;

 private:
  // (the room decides)
};

}  // namespace treeroll
