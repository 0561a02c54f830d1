#include "common/policy/bounded_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace treeroll {

BoundedController::BoundedController(std::unique_ptr<Controller> controller, OutputLimits limits)
    : controller_(std::move(controller)),
      limits_(std::move(limits)),
      has_last_(limits_.has_start),
      last_(limits_.start),
      wanted_(limits_.start) {}

void BoundedController::start() {
  controller_->start();
  has_last_ = limits_.has_start;
  last_ = limits_.start;
}

void BoundedController::act(std::span<const double> input, std::span<double> output) {
  const std::span<double> wanted(wanted_.data(), static_cast<std::size_t>(wanted_.size()));
  controller_->act(input, wanted);
  limit(wanted, output);
}

void BoundedController::act_all(std::span<const double> inputs, std::span<double> outputs) {
  // To the same bits as one by one: each step is bounded by what was given before.
  const auto num_inputs = static_cast<std::size_t>(input_dim());
  const auto num_outputs = static_cast<std::size_t>(output_dim());
  for (std::size_t i = 0; i < inputs.size() / num_inputs; ++i) {
    act(inputs.subspan(i * num_inputs, num_inputs), outputs.subspan(i * num_outputs, num_outputs));
  }
}

void BoundedController::go_on_from(const BoundedController& before) {
  if (!before.has_last_ || before.last_.size() != last_.size()) return;
  has_last_ = true;
  last_ = before.last_;
}

void BoundedController::limit(std::span<double> wanted, std::span<double> given) {
  for (Eigen::Index o = 0; o < last_.size(); ++o) {
    double& value = wanted[static_cast<std::size_t>(o)];
    const double asked = value;
    if (!std::isfinite(asked)) refuse(o, asked, "finite");
    value = std::clamp(asked, limits_.min[o], limits_.max[o]);
    if (limits_.refuses && value != asked) {
      refuse(o, asked, fmt::format("at {} {:.6g}", asked < value ? "least" : "most", value));
    }
    if (!has_last_) continue;
    const double low = last_[o] - limits_.step_max[o];
    const double high = last_[o] + limits_.step_max[o];
    const double within = std::clamp(value, low, high);
    if (limits_.refuses && within != value) {
      refuse(o, asked,
             fmt::format("by its rate at {} {:.6g}", asked < within ? "least" : "most", within));
    }
    value = within;
  }
  for (Eigen::Index o = 0; o < last_.size(); ++o) {
    last_[o] = given[static_cast<std::size_t>(o)] = wanted[static_cast<std::size_t>(o)];
  }
  has_last_ = true;
}

void BoundedController::refuse(Eigen::Index output, double wanted, const std::string& rule) {
  throw std::runtime_error(
      fmt::format("output {} is {:.6g}, must be {} (policy.bounds)", output + 1, wanted, rule));
}

}  // namespace treeroll
