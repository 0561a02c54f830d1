#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/mixture/gmm.h"

namespace treeroll {

/// What spans the frame the children of a Gaussian live in.
enum class FrameKind {
  kEigenvector,  ///< thesis (3-1): p_global = mean + V p. Sign of each axis by continuity.
  kCholesky,     ///< p_global = mean + L p, L the lower Cholesky factor of the covariance
};

/// A policy at several resolutions, coarse (layer 1) to fine (layer L): thesis section 3-1.
/// Every component below layer 1 has a parent in the layer above and is stored in its parent's
/// frame (3-2)..(3-5), so that moving a Gaussian moves all its descendants with it: rigidly with
/// eigenvector frames, stretched with the parent's factor with Cholesky frames. Immutable.
class TreeModel {
 public:
  /// A Gaussian of the tree, in its parent's frame (layer 1: in the global frame).
  struct Node {
    int parent = -1;  ///< index in the layer above; -1 in layer 1
    Component local;
    /// d x d, what spans the frame of its children: V or L of local.covariance. V is stored because
    /// the covariance alone does not tell the signs of its axes; the next V continues this one.
    Eigen::MatrixXd frame;
  };

  /// Layers in the global frame, coarse to fine, with the parents of each component (empty for
  /// layer 1). Throws std::invalid_argument on what Gmm refuses, on differing dimensions, on a
  /// number of parents that is not the layer's and on a parent index outside its layer.
  static TreeModel from_global(FrameKind frame_kind, std::vector<Gmm> layers,
                               std::vector<std::vector<int>> parents);

  /// Layers as they are stored, for reading a tree back: the same bits as the tree they were taken
  /// from. Throws std::invalid_argument as from_global does, naming the layer, and on eigenvector
  /// frames that are not a rotation to the principal axes of their covariance. Cholesky frames
  /// follow from the covariances; what is given for them is not looked at.
  static TreeModel from_nodes(FrameKind frame_kind, int input_dim,
                              std::vector<std::vector<Node>> layers);

  int num_layers() const { return static_cast<int>(layers_.size()); }
  int num_components(int layer) const { return static_cast<int>(nodes(layer).size()); }
  int input_dim() const { return input_dim_; }
  int dim() const { return static_cast<int>(layers_[0][0].local.mean.size()); }
  FrameKind frame_kind() const { return frame_kind_; }
  const std::vector<Node>& nodes(int layer) const;
  /// Index of each component's parent in the layer above; empty for layer 1.
  std::vector<int> parents(int layer) const;

  /// Layer 1 .. L in the global frame, (3-4). Throws std::invalid_argument where ancestors have
  /// moved so far that rounding leaves no valid mixture.
  Gmm layer(int layer) const;
  Gmm finest() const { return layer(num_layers()); }

  /// This tree with layer `layer` replaced by `gmm` (global frame, as many components): layers
  /// above stay, descendants move with their ancestors. Throws std::invalid_argument if the number
  /// of components or a dimension differs, or where rounding leaves no positive definite
  /// covariance.
  TreeModel with_layer(int layer, const Gmm& gmm) const;

 private:
  /// A frame in global coordinates, (3-5): p_global = origin + axes p.
  struct Frame {
    Eigen::VectorXd origin;
    Eigen::MatrixXd axes;
  };

  TreeModel(FrameKind frame_kind, int input_dim, std::vector<std::vector<Node>> layers)
      : frame_kind_(frame_kind), input_dim_(input_dim), layers_(std::move(layers)) {}

  /// Frames in which the components of `layer` are stored: of layer - 1, or the global one.
  std::vector<Frame> frames_above(int layer) const;
  Component to_local(const Frame& frame, const Component& global) const;

  FrameKind frame_kind_;
  int input_dim_;
  std::vector<std::vector<Node>> layers_;
};

}  // namespace treeroll
