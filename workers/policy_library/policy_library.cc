#include <Eigen/Core>
#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/policy/kinds/standard_policies.h"
#include "common/policy/policy_bounds.h"
#include "workers/policy_library/treeroll/policy.h"

struct treeroll_policy {  // NOLINT(readability-identifier-naming): C has no namespaces
  treeroll::PolicyPtr policy;
  treeroll::SignalNames signals;
  std::unique_ptr<treeroll::Controller> controller;
};

namespace {

/// Bounded, and no allocation can fail in it.
class LastError {
 public:
  void set(const char* what) {
    std::strncpy(text_, what, sizeof text_ - 1);
    std::replace_if(
        text_, text_ + std::strlen(text_), [](unsigned char c) { return c < ' ' || c == 0x7f; },
        ' ');
  }
  const char* text() const { return text_; }

 private:
  char text_[1024] = {};  // NOLINT(modernize-avoid-c-arrays): C reads it
};

thread_local LastError last_error;  // NOLINT: one for each thread is what the header promises

/// The floating point mode that evaluators run in, while this exists; then the caller's again. In
/// another one, of a library that flushes small numbers to 0, say, other bits would come out.
class StandardMode {
 public:
  StandardMode() {
    std::fegetenv(&callers_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~StandardMode() { std::fesetenv(&callers_); }
  StandardMode(const StandardMode&) = delete;
  StandardMode& operator=(const StandardMode&) = delete;

 private:
  std::fenv_t callers_{};
};

/// Nothing is thrown into a caller that may know no exceptions.
template <typename Value, typename Function>
Value guarded(Value otherwise, const Function& function) {
  const StandardMode standard;
  try {
    return function();
  } catch (const std::exception& error) {
    last_error.set(error.what());
  } catch (...) {
    last_error.set("unknown");
  }
  return otherwise;
}

void require(bool condition, const char* rule) {
  if (!condition) throw std::invalid_argument(rule);
}

void require_size(const char* what, std::size_t size, int dim) {
  if (size == static_cast<std::size_t>(dim)) return;
  throw std::invalid_argument(std::string(what) + " has " + std::to_string(size) +
                              " numbers, must have " + std::to_string(dim));
}

void require_finite(const char* what, std::span<const double> numbers) {
  if (std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); })) return;
  throw std::invalid_argument(std::string(what) + " must be finite");
}

std::size_t dim_of(const treeroll_policy* policy, int (treeroll::Policy::*dim)() const) {
  return policy == nullptr ? 0 : static_cast<std::size_t>((policy->policy.get()->*dim)());
}

const char* name_at(const std::vector<std::string>& names, std::size_t index) {
  return index < names.size() ? names[index].c_str() : "";
}

}  // namespace

const char* treeroll_policy_version() { return TREEROLL_VERSION; }

const char* treeroll_policy_last_error() { return last_error.text(); }

treeroll_policy* treeroll_policy_load(const char* json) {
  return guarded<treeroll_policy*>(nullptr, [&] {
    require(json != nullptr, "the policy's text is NULL");
    static const treeroll::PolicyRegistry kinds = treeroll::standard_policies();
    treeroll::Result<treeroll::NamedPolicy> read = kinds.named_from_json(json);
    if (!read) throw std::invalid_argument(read.error().message);
    auto controller = read->policy->controller();
    return new treeroll_policy{std::move(read->policy), std::move(read->signals),
                               std::move(controller)};
  });
}

void treeroll_policy_free(treeroll_policy* policy) { delete policy; }

size_t treeroll_policy_input_dim(const treeroll_policy* policy) {
  return dim_of(policy, &treeroll::Policy::input_dim);
}

size_t treeroll_policy_output_dim(const treeroll_policy* policy) {
  return dim_of(policy, &treeroll::Policy::output_dim);
}

size_t treeroll_policy_theta_dim(const treeroll_policy* policy) {
  return dim_of(policy, &treeroll::Policy::theta_dim);
}

const char* treeroll_policy_input_name(const treeroll_policy* policy, size_t index) {
  return policy == nullptr ? "" : name_at(policy->signals.inputs, index);
}

const char* treeroll_policy_output_name(const treeroll_policy* policy, size_t index) {
  return policy == nullptr ? "" : name_at(policy->signals.outputs, index);
}

int treeroll_policy_get_theta(const treeroll_policy* policy, double* theta, size_t size) {
  return guarded(-1, [&] {
    require(policy != nullptr && theta != nullptr, "policy and theta must not be NULL");
    require_size("theta", size, policy->policy->theta_dim());
    const Eigen::VectorXd now = policy->policy->theta();
    std::copy(now.begin(), now.end(), theta);
    return 0;
  });
}

int treeroll_policy_set_theta(treeroll_policy* policy, const double* theta, size_t size) {
  return guarded(-1, [&] {
    require(policy != nullptr && theta != nullptr, "policy and theta must not be NULL");
    require_size("theta", size, policy->policy->theta_dim());
    require_finite("theta", {theta, size});
    const Eigen::Map<const Eigen::VectorXd> numbers(theta, static_cast<Eigen::Index>(size));
    treeroll::PolicyPtr changed = policy->policy->with(numbers);
    auto controller = changed->controller();
    treeroll::go_on_from(*policy->controller, *controller);  // it may be in motion
    policy->policy = std::move(changed);
    policy->controller = std::move(controller);
    return 0;
  });
}

int treeroll_policy_start(treeroll_policy* policy) {
  return guarded(-1, [&] {
    require(policy != nullptr, "the policy must not be NULL");
    policy->controller->start();
    return 0;
  });
}

int treeroll_policy_act(treeroll_policy* policy, const double* input, size_t input_size,
                        double* output, size_t output_size) {
  return guarded(-1, [&] {
    require(policy != nullptr && input != nullptr && output != nullptr,
            "policy, input and output must not be NULL");
    require_size("input", input_size, policy->controller->input_dim());
    require_size("output", output_size, policy->controller->output_dim());
    require_finite("input", {input, input_size});
    policy->controller->act({input, input_size}, {output, output_size});
    return 0;
  });
}

size_t treeroll_policy_text(const treeroll_policy* policy, char* text, size_t size) {
  return guarded<size_t>(0, [&] {
    require(policy != nullptr, "the policy must not be NULL");
    const std::string now = to_json(*policy->policy, policy->signals);
    if (text != nullptr && size > now.size()) std::memcpy(text, now.c_str(), now.size() + 1);
    return now.size() + 1;
  });
}
