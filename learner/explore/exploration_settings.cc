#include "learner/explore/exploration_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/settings/settings_reader.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {
namespace {

/// What is compared at each result is bounded by this.
constexpr std::int64_t kMaxConvergenceWindow = 100'000;
/// The rule of a study that names none.
constexpr const char* kRuleWithVariance = "power";
constexpr const char* kRuleWithout = "auto";
/// Deviations of the output in the first steps, as a share of its size.
constexpr double kSmallStep = .005;
constexpr double kBoldStep = .08;
constexpr double kBoldFromNothing = .3;
/// Of start_work(): some seconds of a processor. A learner says nothing meanwhile.
constexpr double kStartWorkMax = 1e9;

/// What the time that a layer's start takes is proportional to: its metric is a sum over outputs at
/// some hundred inputs, then its axes, and what a projection reaches takes as long.
double start_work(const Policy& policy) {
  const double theta = policy.theta_dim();
  return theta * theta * (theta + 100. * policy.output_dim());
}

/// Reads what every run has. The keys of rules that it does not have are never asked for and so
/// refused.
class Reader {
 public:
  Reader(SettingsReader& source, ExplorationSettings& settings, StartWork work)
      : source_(source), settings_(settings), work_(work) {}

  void read_rule(std::span<const UpdateRuleKind> rules) {
    std::vector<std::string_view> names;
    for (const UpdateRuleKind& kind : rules) names.push_back(kind.name);
    const char* otherwise = source_.has("noise_variance") ? kRuleWithVariance : kRuleWithout;
    const std::string name = source_.choice(
        "rule", names, otherwise,
        {.meaning =
             "How mean and noise follow from rewards: \"power\" is PoWER, the thesis's, and "
             "updates after each result; \"pi2\" PI2-BB, \"cem\" the cross-entropy method and "
             "\"cma_es\" CMA-ES update after each generation; \"auto\" is CMA-ES with a first "
             "step that is tried, and has no key of its own"});
    const auto named = std::find(names.begin(), names.end(), name) - names.begin();
    rules[static_cast<std::size_t>(named)].read(source_, settings_);
  }

  void read_convergence() {
    integer("convergence_window", 2, kMaxConvergenceWindow, settings_.convergence_window,
            {.meaning = "M: of how many last rewards of a layer the slope is taken"});
    settings_.convergence_slope = source_.number(
        "convergence_slope", kAnyNumber, settings_.convergence_slope,
        {.meaning =
             "eps_conv: a layer whose slope is below has converged and is left; equal rewards "
             "have slope 0, which is not below 0",
         .unit = "reward per roll-out"});
    // There is no number that stands for the slope: the key is absent, or a share.
    if (source_.has("convergence_gain")) {
      settings_.convergence_gain = source_.number(
          "convergence_gain", {.min = 0, .max = 1, .min_allowed = false}, {},
          {.meaning = "In place of the slope: a layer is left when its best reward has "
                      "gained less per roll-out of the last M than this share of its "
                      "average gain over the layer",
           .example = "0.3"});
    }
    settings_.stop_on_convergence = source_.boolean(
        "stop_on_convergence", false,
        {.meaning = "Whether a run ends when its last layer has converged. In a report it "
                    "goes on to the end of its budget with its last reward"});
    settings_.stop_at_reward = source_.optional_number(
        "stop_at_reward", kPositive,
        {.meaning = "A run ends with its first roll-out of at least this reward. In a report it "
                    "goes on to the end of its budget with that reward"});
  }

  void read_noise(const Policy& start) {
    const bool may_try_scale = std::exchange(settings_.tries_scale, false);
    if (settings_.initial_step) return;  // The rule has said what the initial noise comes from.
    if (!source_.has("noise_variance")) {
      read_metric(start, may_try_scale);
      return;
    }
    const auto component_dim = static_cast<std::size_t>(start.noise_variance_dim());
    settings_.noise_variance =
        source_.numbers("noise_variance", kVariance, component_dim, component_dim, {},
                        {.meaning = "Sigma_noise, the variances of the first noise, as many as the "
                                    "policy takes: a tree one for each element of one component's "
                                    "theta. Without it the noise follows from the effect of theta "
                                    "on the output",
                         .rule = "each 1e-30 to 1e30"});
    settings_.initial_noise_factor =
        source_.number("initial_noise_factor", kFactor, settings_.initial_noise_factor,
                       {.meaning = "gamma: scales the first noise only"});
  }

  /// A start that does something tells the size of the output; one from nothing does not.
  /// @param may_try_scale  the rule finds a size that nobody tells
  void read_metric(const Policy& start, bool may_try_scale) {
    check_work(start, "noise_variance", "is required");
    const PolicyEffect effect = start.effect();
    const bool is_from_nothing = !does_something(effect);
    settings_.metric = source_.choice("metric", {"full", "diagonal"}, "full",
                                      {.meaning = "Steps that move the output alike in every "
                                                  "direction of theta, or in each of its "
                                                  "elements"}) == "full"
                           ? Metric::kFull
                           : Metric::kDiagonal;
    if (is_from_nothing && may_try_scale && !source_.has("initial_step") && is_scale_tried()) {
      settings_.tries_scale = true;
      settings_.output_scale = 1;
      settings_.initial_step = kStepFromNothing;
      return;
    }
    if (is_from_nothing && !source_.has("output_scale")) {
      source_.refuse("output_scale",
                     "is required: the start policy does nothing, so nothing tells how large the "
                     "outputs of a good policy are. Give their size, or noise_variance");
    }
    settings_.output_scale = source_.number(
        "output_scale", kFactor,
        is_from_nothing ? std::nullopt : std::optional(output_size(effect)),
        {.meaning = "How large the outputs of a good policy are. For a start that does nothing it "
                    "is required, but by rule \"auto\" without initial_step",
         .unit = "the output's unit",
         .otherwise = "the size of the start policy's output"});
    const double usual_step =
        (is_from_nothing ? kStepFromNothing : kSmallStep) * settings_.output_scale;
    settings_.initial_step = source_.number(
        "initial_step", kFactor, usual_step,
        {.meaning =
             "Deviation of the output in the first steps. Rule \"auto\" tries bolder ones: 16 "
             "times as large, 3 times for a start that does nothing, but never bolder than "
             "with the default",
         .unit = "the output's unit",
         .otherwise = ".005 of output_scale; .1 of it for a start that does nothing"});
    settings_.boldness = std::min(1., *settings_.initial_step / usual_step);
    settings_.bold_step = settings_.boldness * (is_from_nothing ? kBoldFromNothing : kBoldStep) *
                          settings_.output_scale;
  }

  void read_layers(const Policy& start) {
    const int num_layers = start.num_layers();
    settings_.reuse = source_.boolean(
        "reuse", settings_.reuse,
        {.meaning = "Whether the next layer begins with the experience of the one left, section "
                    "3-2-4; false: with noise and history afresh"});
    integer("first_layer", 1, num_layers, settings_.first_layer,
            {.meaning = "The layer that is explored first", .rule = "1 to the policy's last"});
    settings_.last_layer = num_layers;
    integer("last_layer", 1, num_layers, settings_.last_layer,
            {.meaning = "The layer that is explored to the end of the budget",
             .otherwise = "the policy's last",
             .rule = "first_layer to the policy's last"});
    if (settings_.last_layer < settings_.first_layer) {
      source_.refuse("last_layer", "must be at least first_layer, which is " +
                                       std::to_string(settings_.first_layer));
    }
    for (int layer = settings_.first_layer; layer <= settings_.last_layer; ++layer) {
      const PolicyPtr policy = start.at_layer(layer);
      if (settings_.metric) {
        check_work(*policy, "noise_variance", "is required");
      } else if (settings_.initial_step) {
        check_work(*policy, "coordinates", "must be \"noise_variance\"");
      } else if (settings_.reuse && layer > settings_.first_layer) {
        check_work(*policy, "reuse", "must be false");
      }
    }
  }

 private:
  bool is_scale_tried() {
    constexpr const char* kKey = "output_scale";
    constexpr const char* kTried = "auto";
    if (source_.has(kKey) &&
        !source_.is_word(kKey, kTried,
                         {.meaning = "Sizes from .02 to 50 are tried in the first "
                                     "generation: of a start that does nothing"})) {
      return false;
    }
    source_.string(kKey, kTried,
                   {.meaning = "\"auto\", of rule \"auto\" for a start that does nothing: sizes "
                               "from .02 to 50 are tried in the first generation"});
    return true;
  }

  void check_work(const Policy& policy, const char* key, const char* rule) {
    if (work_ == StartWork::kAny || start_work(policy) <= kStartWorkMax) return;
    source_.refuse(
        key,
        fmt::format("{}: otherwise theta^2 x (theta + 100 x outputs) must be at most {:.0e}, "
                    "and theta of layer {} has {} elements for {} outputs",
                    rule, kStartWorkMax, policy.layer(), policy.theta_dim(), policy.output_dim()));
  }

  /// `value` is the default and takes the result.
  void integer(const char* key, std::int64_t min, std::int64_t max, int& value,
               const KeyHelp& help) {
    value = static_cast<int>(source_.integer(key, min, max, value, help));
  }

  SettingsReader& source_;
  ExplorationSettings& settings_;
  StartWork work_;
};

}  // namespace

ExplorationSettings read_exploration_settings(SettingsReader& exploration, const Policy& start,
                                              std::span<const UpdateRuleKind> rules,
                                              StartWork work) {
  ExplorationSettings settings;
  Reader reader(exploration, settings, work);
  reader.read_rule(rules);
  reader.read_convergence();
  reader.read_noise(start);
  reader.read_layers(start);
  return settings;
}

}  // namespace treeroll::explore
