#pragma once

#include <span>

namespace treeroll {

/// What a task drives its plant with for the length of a roll-out: all that a task knows of a
/// policy. Belongs to one roll-out and one thread.
///
///   controller.start();
///   const double cart_acceleration_mps2 = controller.act(time_s);
class Controller {
 public:
  virtual ~Controller() = default;
  virtual int input_dim() const = 0;
  virtual int output_dim() const = 0;
  /// To be called before each roll-out: a controller with a state of its own, such as one that
  /// integrates, begins anew. Most have none.
  virtual void start() {}
  /// What the controller gives for an input, in the units of the task. Allocates nothing.
  /// @param input   input_dim() finite numbers
  /// @param output  output_dim() numbers, finite for every finite input
  virtual void act(std::span<const double> input, std::span<double> output) = 0;

  /// act() for inputs one after the other, to the same bits; a controller may be quicker at it.
  /// @param inputs   N x input_dim(), row by row
  /// @param outputs  N x output_dim(), row by row
  virtual void act_all(std::span<const double> inputs, std::span<double> outputs);

  /// The same for one input and one output. Precondition: input_dim() and output_dim() are 1.
  double act(double input) {
    double output = 0;
    act(std::span<const double>(&input, 1), std::span<double>(&output, 1));
    return output;
  }
};

}  // namespace treeroll
