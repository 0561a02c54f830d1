#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/signal_names.h"
#include "common/policy/controller.h"

namespace treeroll {

class Policy;
using PolicyPtr = std::shared_ptr<const Policy>;

/// Theta of a layer that acts as a theta of the layer above it acted; nothing if that is so extreme
/// that none does.
using Projection = std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd& theta)>;

/// Where learning goes on when a layer is left.
struct NextLayer {
  PolicyPtr policy;
  Projection project;  ///< from the layer left; it stays valid as long as it is kept
};

/// What theta does to the output, over inputs spread where the policy acts.
struct PolicyEffect {
  /// N x dO, as the policy stands. Of one input: at inputs that rise evenly over their range.
  Eigen::MatrixXd outputs;
  Eigen::MatrixXd derivative;  ///< (N dO) x n, d output / d theta: input by input
  /// n x 1: what an element that is no output counts for at least, per unit of output. A Gaussian's
  /// mean input: 2 / deviation, so that it never steps by more than about half of that, though
  /// nothing may move where the outputs are equal. 0 for elements in the output's unit.
  Eigen::VectorXd least;
};

/// What a picture can show of a policy.
struct PolicySketch {
  /// Drawn as an ellipse over [input; output].
  struct Gaussian {
    Eigen::VectorXd mean;
    Eigen::MatrixXd covariance;
  };
  struct Layer {
    std::vector<Gaussian> gaussians;         ///< empty where the kind has none
    std::unique_ptr<Controller> controller;  ///< what this layer alone would do
  };
  /// Where there is something to see of an input.
  struct Range {
    double low = 0;
    double high = 0;
  };
  std::vector<Layer> layers;  ///< coarse to fine; roll-outs execute the last one
  std::vector<Range> inputs;  ///< dI of them
  /// Equal for policies that differ at most in which of their numbers are explored.
  std::string look;
};

/// A mapping from inputs to outputs at several resolutions, coarse (layer 1) to fine, of which one
/// layer is explored: theta are the numbers that are explored there, everything else is the
/// policy's own business. Immutable, shared between runs and threads. A new kind derives from this
/// and is registered by name: policy_registry.h.
class Policy {
 public:
  virtual ~Policy() = default;

  virtual std::string_view kind() const = 0;  ///< its name in the registry
  virtual int input_dim() const = 0;
  virtual int output_dim() const = 0;
  virtual int num_layers() const = 0;
  virtual int layer() const = 0;  ///< that is explored, 1 .. num_layers()
  /// The same behaviour, explored at another layer. Precondition: there is such a layer.
  virtual PolicyPtr at_layer(int layer) const = 0;

  virtual int theta_dim() const = 0;
  /// Theta as the policy stands: theta_dim() numbers.
  virtual Eigen::VectorXd theta() const = 0;
  /// The policy with theta in place of its own. Throws std::invalid_argument where theta is so
  /// extreme that there is none. Precondition: theta is finite and has theta_dim() numbers.
  virtual PolicyPtr with(const Eigen::VectorXd& theta) const = 0;
  /// What a roll-out executes: the finest layer, whatever layer is explored, for rewards are always
  /// taken there (section 3-2-4). Throws std::invalid_argument as with() does.
  virtual std::unique_ptr<Controller> controller() const = 0;

  /// with(theta), explored one layer finer, and how roll-outs of this layer look there.
  /// Throws std::invalid_argument as with() does. Precondition: this is not the last layer.
  virtual NextLayer next_layer(const Eigen::VectorXd& theta) const = 0;

  /// Numbers a study gives for the variance of the exploration noise (exploration.noise_variance),
  /// the same for every layer.
  virtual int noise_variance_dim() const = 0;
  /// Those numbers for each element of theta.
  /// @return  theta_dim() numbers. Precondition: there are noise_variance_dim() of them
  virtual Eigen::VectorXd noise_variance(std::span<const double> given) const = 0;
  /// Steps of theta that change the output alike: s_i = 1 / rms(du / dtheta_i), the mean over
  /// inputs where the policy acts.
  /// @return  theta_dim() numbers above 0, in units of theta_i per unit of output
  virtual Eigen::VectorXd steps_of_equal_effect() const = 0;
  virtual PolicyEffect effect() const = 0;

  virtual PolicySketch sketch() const = 0;
  /// What to_json() writes of it: a JSON object, without "format", "version" and "kind".
  virtual nlohmann::json content() const = 0;
};

/// The kind of a policy whose text or settings name none.
inline constexpr std::string_view kDefaultPolicyKind = "tree";

/// JSON, keys sorted, numbers in their shortest exact form: equal policies give equal text, and
/// PolicyRegistry::from_json() gives back the same bits. What workers and the learner exchange, and
/// what a policy file holds:
///
///   {"format": "treeroll-policy", "version": 1, "kind": NAME, ...}
///
/// with what the kind has to say of itself. A text without "kind" is a tree's.
std::string to_json(const Policy& policy);
/// The same for people and robots, with what inputs and outputs are called, if anybody has named
/// them: "signals": {"inputs": [...], "outputs": [...]}. Workers are sent none: policies are known
/// by the hash of their text. Precondition: the names are those of its inputs and outputs
/// (fault_of())
std::string to_json(const Policy& policy, const SignalNames& signals);

}  // namespace treeroll
