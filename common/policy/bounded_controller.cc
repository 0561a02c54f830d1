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
      last_(limits_.start),
      wanted_(limits_.start) {}

void BoundedController::start() {
  controller_->start();
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

void BoundedController::limit(std::span<double> wanted, std::span<double> given) {
  for (Eigen::Index o = 0; o < last_.size(); ++o) {
    double& value = wanted[static_cast<std::size_t>(o)];
    const double asked = value;
    const bool has_last = !std::isnan(last_[o]);
    value = std::clamp(asked, limits_.min[o], limits_.max[o]);
    if (limits_.refuses && value != asked) {
      refuse(o, asked, asked < value ? "at least" : "at most", value);
    }
    if (!has_last) continue;
    const double low = last_[o] - limits_.step_max[o];
    const double high = last_[o] + limits_.step_max[o];
    const double within = std::clamp(value, low, high);
    if (limits_.refuses && within != value) {
      refuse(o, asked, asked < within ? "by its rate at least" : "by its rate at most", within);
    }
    value = within;
  }
  for (Eigen::Index o = 0; o < last_.size(); ++o) {
    last_[o] = given[static_cast<std::size_t>(o)] = wanted[static_cast<std::size_t>(o)];
  }
}

void BoundedController::refuse(Eigen::Index output, double wanted, const char* rule, double limit) {
  throw std::runtime_error(fmt::format("output {} is {:.6g}, must be {} {:.6g} (policy.bounds)",
                                       output + 1, wanted, rule, limit));
}

}  // namespace treeroll
