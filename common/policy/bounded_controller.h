#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "common/policy/controller.h"

namespace treeroll {

/// Limits of each output, all of one size, dO x 1; infinite where there is none.
struct OutputLimits {
  bool refuses = false;
  Eigen::VectorXd min;
  Eigen::VectorXd max;
  Eigen::VectorXd step_max;  ///< from one asking to the next
  Eigen::VectorXd start;     ///< before the first asking, if has_start
  bool has_start = false;
};

/// A controller whose outputs stay within limits: clipped, or refused by a std::runtime_error that
/// names the output, its value and the limit. Clipped first to min and max, then to what the last
/// output that was given allows. An output that is not finite is always refused: there is nothing
/// to clip it to. Allocates nothing but for a refusal.
class BoundedController : public Controller {
 public:
  BoundedController(std::unique_ptr<Controller> controller, OutputLimits limits);

  int input_dim() const override { return controller_->input_dim(); }
  int output_dim() const override { return controller_->output_dim(); }
  void start() override;
  void act(std::span<const double> input, std::span<double> output) override;
  void act_all(std::span<const double> inputs, std::span<double> outputs) override;

  /// Takes over what another one has given last, so that the rate holds from one to the other.
  void go_on_from(const BoundedController& before);

 private:
  /// What is given for what the policy wants. Neither `given` nor the memory of what was given last
  /// changes if it throws.
  void limit(std::span<double> wanted, std::span<double> given);
  [[noreturn]] static void refuse(Eigen::Index output, double wanted, const std::string& rule);

  std::unique_ptr<Controller> controller_;
  OutputLimits limits_;
  bool has_last_;
  Eigen::VectorXd last_;
  Eigen::VectorXd wanted_;
};

}  // namespace treeroll
