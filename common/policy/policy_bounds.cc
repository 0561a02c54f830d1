#include "common/policy/policy_bounds.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/policy/bounded_controller.h"

namespace treeroll {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;

/// One number for all, or a number each.
Eigen::VectorXd for_each(const std::vector<double>& given, Eigen::Index count, double otherwise) {
  if (given.empty()) return Eigen::VectorXd::Constant(count, otherwise);
  if (given.size() == 1) return Eigen::VectorXd::Constant(count, given[0]);
  return Eigen::Map<const Eigen::VectorXd>(given.data(), count);
}

class BoundedPolicy final : public Policy {
 public:
  BoundedPolicy(PolicyPtr policy, PolicyBounds bounds)
      : policy_(std::move(policy)), bounds_(std::move(bounds)) {}

  const PolicyPtr& policy() const { return policy_; }
  const PolicyBounds& bounds() const { return bounds_; }

  std::string_view kind() const override { return policy_->kind(); }
  int input_dim() const override { return policy_->input_dim(); }
  int output_dim() const override { return policy_->output_dim(); }
  int num_layers() const override { return policy_->num_layers(); }
  int layer() const override { return policy_->layer(); }
  PolicyPtr at_layer(int layer) const override { return within(policy_->at_layer(layer)); }
  int theta_dim() const override { return policy_->theta_dim(); }
  Eigen::VectorXd theta() const override { return policy_->theta(); }
  PolicyPtr with(const Eigen::VectorXd& theta) const override {
    return within(policy_->with(permitted(theta)));
  }

  std::unique_ptr<Controller> controller() const override {
    const Eigen::Index dim = output_dim();
    OutputLimits limits{.refuses = bounds_.refuses,
                        .min = for_each(bounds_.output_min, dim, -kInfinity),
                        .max = for_each(bounds_.output_max, dim, kInfinity),
                        .step_max = for_each(bounds_.output_rate_max, dim, kInfinity),
                        .start = for_each(bounds_.output_start, dim, 0),
                        .has_start = !bounds_.output_start.empty()};
    if (!bounds_.output_rate_max.empty()) limits.step_max *= bounds_.sample_time_s;
    return std::make_unique<BoundedController>(held(policy_)->controller(), std::move(limits));
  }

  NextLayer next_layer(const Eigen::VectorXd& theta) const override {
    NextLayer next = policy_->next_layer(permitted(theta));
    // A finer layer may hold other numbers. Those that are refused its roll-outs will tell.
    next.policy = within(bounds_.refuses ? std::move(next.policy) : held(next.policy));
    return next;
  }

  int noise_variance_dim() const override { return policy_->noise_variance_dim(); }
  Eigen::VectorXd noise_variance(std::span<const double> given) const override {
    return policy_->noise_variance(given);
  }
  Eigen::VectorXd steps_of_equal_effect() const override {
    return policy_->steps_of_equal_effect();
  }
  PolicyEffect effect() const override { return policy_->effect(); }
  PolicySketch sketch() const override { return policy_->sketch(); }

  nlohmann::json content() const override {
    nlohmann::json content = policy_->content();
    content["bounds"] = {{"outside", bounds_.refuses ? "refuse" : "clip"},
                         {"theta_min", bounds_.theta_min},
                         {"theta_max", bounds_.theta_max},
                         {"output_min", bounds_.output_min},
                         {"output_max", bounds_.output_max},
                         {"output_rate_max", bounds_.output_rate_max},
                         {"sample_time_s", bounds_.sample_time_s},
                         {"output_start", bounds_.output_start}};
    return content;
  }

 private:
  PolicyPtr within(PolicyPtr policy) const {
    return std::make_shared<BoundedPolicy>(std::move(policy), bounds_);
  }

  /// A bound of each element of a policy's theta.
  static Eigen::VectorXd of_theta(const Policy& policy, const std::vector<double>& given,
                                  double otherwise) {
    if (given.size() < 2) return for_each(given, policy.theta_dim(), otherwise);
    return policy.noise_variance(given);
  }

  Eigen::VectorXd permitted(const Eigen::VectorXd& theta) const {
    return permitted(*policy_, theta);
  }

  /// A policy without bounds, whose own theta was never asked: from a text, or of another layer.
  PolicyPtr held(const PolicyPtr& policy) const {
    if (bounds_.theta_min.empty() && bounds_.theta_max.empty()) return policy;
    const Eigen::VectorXd theta = policy->theta();
    const Eigen::VectorXd min = of_theta(*policy, bounds_.theta_min, -kInfinity);
    const Eigen::VectorXd max = of_theta(*policy, bounds_.theta_max, kInfinity);
    const Eigen::ArrayXd beyond = (theta - theta.cwiseMax(min).cwiseMin(max)).array().abs();
    // with() of what is at the bound may give it back rounded.
    if ((beyond <= kRounding * theta.array().abs().max(1)).all()) return policy;
    return policy->with(permitted(*policy, theta));
  }

  /// Theta within the bounds. Throws std::invalid_argument where they refuse it.
  Eigen::VectorXd permitted(const Policy& policy, const Eigen::VectorXd& theta) const {
    const Eigen::VectorXd min = of_theta(policy, bounds_.theta_min, -kInfinity);
    const Eigen::VectorXd max = of_theta(policy, bounds_.theta_max, kInfinity);
    Eigen::VectorXd within = theta.cwiseMax(min).cwiseMin(max);
    if (!bounds_.refuses) return within;
    for (Eigen::Index i = 0; i < theta.size(); ++i) {
      if (theta[i] == within[i]) continue;
      throw std::invalid_argument(
          fmt::format("element {} of theta is {:.6g}, must be at {} {:.6g} (policy.bounds)", i + 1,
                      theta[i], theta[i] < min[i] ? "least" : "most", within[i]));
    }
    return within;
  }

  PolicyPtr policy_;
  PolicyBounds bounds_;
};

}  // namespace

PolicyPtr bounded(PolicyPtr policy, PolicyBounds bounds) {
  return std::make_shared<BoundedPolicy>(std::move(policy), std::move(bounds));
}

void go_on_from(const Controller& before, Controller& controller) {
  const auto* bounded_before = dynamic_cast<const BoundedController*>(&before);
  auto* bounded = dynamic_cast<BoundedController*>(&controller);
  if (bounded_before != nullptr && bounded != nullptr) bounded->go_on_from(*bounded_before);
}

double sample_time_s(const Policy& policy) {
  const auto* bounded = dynamic_cast<const BoundedPolicy*>(&policy);
  return bounded == nullptr ? 0 : bounded->bounds().sample_time_s;
}

PolicyPtr without_bounds(const PolicyPtr& policy) {
  const auto* bounded = dynamic_cast<const BoundedPolicy*>(policy.get());
  return bounded == nullptr ? policy : bounded->policy();
}

}  // namespace treeroll
