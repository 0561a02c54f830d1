#pragma once

#include <Eigen/Core>

#include "common/mixture/gmr.h"
#include "common/policy/controller.h"

namespace treeroll {

/// Gaussian mixture regression as a controller: Gmr::regress(), to the bit, with its work space
/// made once.
class TreeController final : public Controller {
 public:
  explicit TreeController(const Gmm& gmm) : gmr_(gmm), work_(gmr_.work_space()) {}

  int input_dim() const override { return gmr_.input_dim(); }
  int output_dim() const override { return gmr_.output_dim(); }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override;
  void act_all(std::span<const double> inputs, std::span<double> outputs) override;

 private:
  Gmr gmr_;
  Gmr::WorkSpace work_;
};

}  // namespace treeroll
