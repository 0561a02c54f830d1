#include "learner/app/preview_study.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/csv_field.h"
#include "common/policy/policy_bounds.h"
#include "common/program/standard_output.h"
#include "learner/explore/exploration.h"
#include "learner/study/study_file.h"

namespace treeroll {
namespace {

constexpr int kInputsShown = 101;
constexpr double kInputsMax = 1e5;

/// A policy as it is shown: the start, or a draw of a repetition.
struct Shown {
  std::string name;  ///< "start", "0:3": repetition and roll-out
  Eigen::VectorXd theta;
  PolicyPtr policy;  ///< null where theta makes none
  std::string refusal;
};

Shown shown(std::string name, const Policy& explored, const Eigen::VectorXd& theta) {
  Shown result{.name = std::move(name), .theta = theta, .policy = {}, .refusal = {}};
  try {
    result.policy = explored.with(theta);
  } catch (const std::invalid_argument& error) {
    result.refusal = error.what();
  }
  return result;
}

/// The start, then `count` draws: those of repetition 0 that come before its first update, then
/// those of 1, and so on, in or past the study.
std::vector<Shown> policies_of(const Condition& condition, std::uint64_t seed, int count) {
  const PolicyPtr explored = condition.start->at_layer(condition.exploration.first_layer);
  std::vector<Shown> all{shown("start", *explored, explored->theta())};
  explore::ExplorationSettings settings = condition.exploration;
  // Drawn from the first distribution: what the rule wants before it learns, and what is in flight.
  const explore::LayerStart first = explore::first_start(settings, *condition.start);
  const int first_update = settings.rule.make(first)->first_update();
  settings.in_flight = std::max(settings.in_flight, first_update);
  settings.num_rollouts = std::max(settings.num_rollouts, count);
  for (std::uint32_t repetition = 0; static_cast<int>(all.size()) <= count; ++repetition) {
    explore::Exploration run(settings, *condition.start, first, seed, repetition);
    while (static_cast<int>(all.size()) <= count) {
      const std::optional<explore::Draw> draw = run.ask();
      if (!draw) break;
      all.push_back(shown(fmt::format("{}:{}", repetition, draw->rollout), *explored, draw->theta));
    }
  }
  return all;
}

/// As a task would ask, where the policy's bounds say how often that is.
std::vector<double> inputs_of(const Policy& policy) {
  const PolicySketch sketch = policy.sketch();
  const auto [low, high] = sketch.inputs.front();
  const double length = high - low;
  const double step = sample_time_s(policy);
  const int count =
      step > 0 ? static_cast<int>(std::min(length / step + 1, kInputsMax)) : kInputsShown;
  std::vector<double> inputs;
  for (int i = 0; i < count; ++i) {
    inputs.push_back(low + (step > 0 ? i * step : length * i / (count - 1)));
  }
  return inputs;
}

/// Of one output that some policies have given.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

/// Of each output: one in metres is not to be lost beside one in newtons.
struct Ranges {
  int num_policies = 0;  ///< that have given any
  std::vector<Range> of_outputs;

  std::string in_words() const {
    if (num_policies == 0) return "nothing";
    std::vector<std::string> words;
    for (const Range& range : of_outputs) {
      words.push_back(fmt::format("{:.4g} to {:.4g}", range.low, range.high));
      if (of_outputs.size() > 1) words.back() += fmt::format(" (output {})", words.size());
    }
    return fmt::format("{}", fmt::join(words, ", "));
  }
};

/// A row an input, up to the one for which the policy's bounds refuse the output: they throw
/// std::runtime_error.
void print_curve(const std::string& condition, Shown& shown, const std::vector<double>& inputs,
                 Ranges& ranges) {
  const auto output_dim = static_cast<std::size_t>(shown.policy->output_dim());
  std::vector<double> outputs(output_dim);
  ranges.of_outputs.resize(output_dim);
  const std::unique_ptr<Controller> controller = shown.policy->controller();
  controller->start();
  for (const double& input : inputs) {
    controller->act({&input, 1}, outputs);
    if (&input == &inputs.front()) ++ranges.num_policies;
    fmt::print("{},{},{},{}\n", csv_field(condition), shown.name, input, fmt::join(outputs, ","));
    for (std::size_t i = 0; i < output_dim; ++i) {
      Range& range = ranges.of_outputs[i];
      range.low = std::min(range.low, outputs[i]);
      range.high = std::max(range.high, outputs[i]);
    }
  }
}

void preview(const Condition& condition, std::uint64_t seed, int count) {
  std::vector<Shown> all = policies_of(condition, seed, count);
  const bool is_curve = condition.start->input_dim() == 1;
  std::vector<double> inputs;
  if (is_curve) inputs = inputs_of(*condition.start);
  Ranges start;
  Ranges drawn;
  for (Shown& one : all) {
    if (!one.policy) {
      spdlog::warn("{}: draw {} is no policy: {}", condition.name, one.name, one.refusal);
    } else if (is_curve) {
      Ranges& of_kind = &one == &all.front() ? start : drawn;
      try {
        print_curve(condition.name, one, inputs, of_kind);
      } catch (const std::runtime_error& error) {
        spdlog::warn("{}: draw {} ends early: {}", condition.name, one.name, error.what());
      }
    } else {
      fmt::print("{},{},{}\n", csv_field(condition.name), one.name, fmt::join(one.theta, ","));
    }
  }
  if (is_curve) {
    spdlog::info("{}: the start gives {}, {} of {} draws give {}", condition.name, start.in_words(),
                 drawn.num_policies, count, drawn.in_words());
  }
}

std::string numbered(const char* what, int count) {
  std::string names;
  for (int i = 1; i <= count; ++i) names += fmt::format(",{}_{}", what, i);
  return names;
}

}  // namespace

void preview_study(const LearnerOptions& options) {
  const LoadedStudy loaded = load_study(options.study_file, options.overrides);
  std::string heading;
  for (const Condition& condition : loaded.study.conditions) {
    const Policy& start = *condition.start;
    const int first_layer = condition.exploration.first_layer;
    const std::string columns = start.input_dim() == 1
                                    ? ",input" + numbered("output", start.output_dim())
                                    : numbered("theta", start.at_layer(first_layer)->theta_dim());
    // Conditions may differ in what there is to show: each such table has its heading.
    if (columns != heading) fmt::print("condition,draw{}\n", columns);
    heading = columns;
    preview(condition, loaded.study.seed, options.preview);
  }
  flush_standard_output();
}

}  // namespace treeroll
