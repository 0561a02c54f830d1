#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/policy/policy_bounds.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

constexpr NumberRule kBound{.min = -1e50, .max = 1e50};
constexpr NumberRule kRate{.min = 0, .max = 1e50, .min_allowed = false};
constexpr NumberRule kSampleTime{.min = 1e-9, .max = 1e6};

/// An optional list of one number, or of one for each.
std::vector<double> read_list(SettingsReader& table, const char* key, NumberRule rule, int count,
                              const KeyHelp& help) {
  if (!table.has(key)) return {};
  std::vector<double> numbers =
      table.numbers(key, rule, 1, static_cast<std::size_t>(count), {}, help);
  if (numbers.size() != 1 && std::ssize(numbers) != count) {
    table.refuse(key, fmt::format("must hold one number, or {}", count));
  }
  return numbers;
}

double at(const std::vector<double>& list, std::size_t i) {
  return list.size() == 1 ? list[0] : list[i];
}

void check_order(const SettingsReader& table, const char* key, const std::vector<double>& low,
                 const std::vector<double>& high, const char* rule) {
  if (low.empty() || high.empty()) return;
  for (std::size_t i = 0; i < std::max(low.size(), high.size()); ++i) {
    if (at(low, i) > at(high, i)) table.refuse(key, rule);
  }
}

}  // namespace

PolicyBounds read_policy_bounds(SettingsReader table, const PolicyPtr& policy) {
  PolicyBounds bounds;
  bounds.refuses =
      table.choice(
          "outside", {"clip", "refuse"}, {},
          {.meaning = "What becomes of a theta or an output beyond the bounds: it is set to "
                      "the bound, or the roll-out fails and nothing of it is given out"}) ==
      "refuse";
  const int thetas = policy->noise_variance_dim();
  bounds.theta_min = read_list(
      table, "theta_min", kBound, thetas,
      {.meaning = "Least value of theta in the layer that is explored: one number, or one for "
                  "each number of noise_variance; the start obeys it in every layer",
       .rule = "each -1e50 to 1e50",
       .example = "[-100.0]"});
  bounds.theta_max = read_list(table, "theta_max", kBound, thetas,
                               {.meaning = "Greatest value of theta, as theta_min",
                                .rule = "each -1e50 to 1e50",
                                .example = "[100.0]"});
  const int outputs = policy->output_dim();
  bounds.output_min =
      read_list(table, "output_min", kBound, outputs,
                {.meaning = "Least value of each output: one number for all, or one "
                            "each",
                 .unit = "the output's unit",
                 .rule = "each -1e50 to 1e50",
                 .example = "[-20.0]"});
  bounds.output_max = read_list(table, "output_max", kBound, outputs,
                                {.meaning = "Greatest value of each output",
                                 .unit = "the output's unit",
                                 .rule = "each -1e50 to 1e50",
                                 .example = "[20.0]"});
  bounds.output_rate_max = read_list(
      table, "output_rate_max", kRate, outputs,
      {.meaning =
           "How fast each output may change: from one asking of the policy to the next by this "
           "times sample_time_s",
       .unit = "the output's unit per s",
       .rule = "each above 0 to 1e50",
       .example = "[200.0]"});
  if (!bounds.output_rate_max.empty()) {
    bounds.sample_time_s = table.number(
        "sample_time_s", kSampleTime, {},
        {.meaning =
             "The time between two askings of the policy, as the task has it; one that integrates "
             "asks in the middle of steps too: half of step_s",
         .unit = "s",
         .example = "0.01"});
    bounds.output_start = read_list(
        table, "output_start", kBound, outputs,
        {.meaning = "What stands at the outputs before a roll-out, from where its first "
                    "output may change; without it the first may be any within the bounds",
         .unit = "the output's unit",
         .rule = "each within output_min and output_max",
         .example = "[0.0]"});
  }
  table.finish();
  check_order(table, "theta_max", bounds.theta_min, bounds.theta_max,
              "must not be below theta_min");
  check_order(table, "output_max", bounds.output_min, bounds.output_max,
              "must not be below output_min");
  check_order(table, "output_start", bounds.output_min, bounds.output_start,
              "must not be below output_min");
  check_order(table, "output_start", bounds.output_start, bounds.output_max,
              "must not be above output_max");
  // Of a start that is refused nothing could be learnt.
  // One bound at a time, so that the key that is refused is the one to change.
  for (const char* key : {"theta_min", "theta_max"}) {
    PolicyBounds strict = bounds;
    strict.refuses = true;
    (std::string_view(key) == "theta_min" ? strict.theta_max : strict.theta_min).clear();
    for (int layer = 1; layer <= policy->num_layers(); ++layer) {
      try {
        static_cast<void>(bounded(policy->at_layer(layer), strict)->controller());
      } catch (const std::invalid_argument& error) {
        table.refuse(
            key, fmt::format("the start policy is beyond it in layer {}: {}", layer, error.what()));
      }
    }
  }
  return bounds;
}

PolicyBounds bounds_from_content(const PolicyText& content, const Policy& policy) {
  content.need_keys({"outside", "theta_min", "theta_max", "output_min", "output_max",
                     "output_rate_max", "sample_time_s", "output_start"});
  const auto list = [&](const char* key, int count) {
    const PolicyText text = content.at(key);
    std::vector<double> numbers(text.list_size(0, static_cast<std::size_t>(count)));
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = text.at(i).number();
    if (numbers.size() > 1 && std::ssize(numbers) != count) {
      text.refuse(fmt::format("must hold nothing, one number or {}", count));
    }
    return numbers;
  };
  const int thetas = policy.noise_variance_dim();
  const int outputs = policy.output_dim();
  PolicyBounds bounds;
  bounds.refuses = content.at("outside").word({"clip", "refuse"}) == 1;
  bounds.theta_min = list("theta_min", thetas);
  bounds.theta_max = list("theta_max", thetas);
  bounds.output_min = list("output_min", outputs);
  bounds.output_max = list("output_max", outputs);
  bounds.output_rate_max = list("output_rate_max", outputs);
  bounds.sample_time_s = content.at("sample_time_s").number();
  bounds.output_start = list("output_start", outputs);
  const auto need_order = [&](const char* key, const std::vector<double>& low,
                              const std::vector<double>& high) {
    if (low.empty() || high.empty()) return;
    for (std::size_t i = 0; i < std::max(low.size(), high.size()); ++i) {
      if (!(at(low, i) <= at(high, i))) content.at(key).refuse("must be in order with the others");
    }
  };
  need_order("theta_max", bounds.theta_min, bounds.theta_max);
  need_order("output_max", bounds.output_min, bounds.output_max);
  need_order("output_start", bounds.output_min, bounds.output_start);
  need_order("output_start", bounds.output_start, bounds.output_max);
  if (!bounds.output_rate_max.empty() && !(bounds.sample_time_s > 0)) {
    content.at("sample_time_s").refuse("must be above 0");
  }
  for (std::size_t i = 0; i < bounds.output_rate_max.size(); ++i) {
    if (!(bounds.output_rate_max[i] > 0)) content.at("output_rate_max").refuse("must be above 0");
  }
  return bounds;
}

}  // namespace treeroll
