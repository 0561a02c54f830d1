#include "learner/report/figures/policy_plot.h"

#include <fmt/format.h>

#include <algorithm>

#include "learner/report/figures/policy_figure.h"

namespace treeroll::report {
namespace {

constexpr int kLayersNamed = 2;

/// The best policy with the Gaussians of its layers, and the start.
class BeforeAndAfter : public PolicyFigure {
 public:
  std::string line_types() const override { return kStartAndGoalLines; }
  std::string goal_style() const override { return "lt 9"; }
  std::string panel_title(const LearntPolicy& policy) const override { return policy.condition; }

  std::string input_range(const LearntPolicy& policy) const override {
    const Range range = policy.start->sketch().inputs.front();
    return fmt::format("[{}:{}]", range.low, range.high);
  }

  std::string lines(const LearntPolicy& policy, const View& view, const std::string& goal,
                    DataSets& data) const override {
    const Plane plane = view.plane;
    const PolicySketch start = policy.start->sketch();
    // A path ends where the task ends it; beyond, the policy is nobody's path.
    const Range drawn = view.is_path ? inputs_of(policy) : start.inputs.front();
    const PolicySketch learnt = after(policy).sketch();
    std::string lines = goal;
    lines += ellipses(start.layers.back(), plane, "lt 2 lw 1", data);
    lines += curve(start.layers.back(), plane, drawn, "lt 2", data) + ", ";
    for (int layer = 1; layer <= static_cast<int>(learnt.layers.size()); ++layer) {
      const std::string style = fmt::format("lt {} lw 1", std::min(layer, kLayersNamed + 1) + 2);
      lines += ellipses(learnt.layers[static_cast<std::size_t>(layer - 1)], plane, style, data);
    }
    return lines + curve(learnt.layers.back(), plane, drawn, "lt 1", data);
  }

  std::vector<std::string> labels(const PolicyRows& rows, bool has_goal) const override {
    const int num_layers = num_mixtures(rows);
    std::vector<std::string> labels = {"learnt", "start"};
    for (int layer = 1; layer <= std::min(num_layers, kLayersNamed); ++layer) {
      labels.push_back(fmt::format("layer {}", layer));
    }
    if (num_layers > kLayersNamed) labels.emplace_back("further layers");
    if (has_goal) {
      labels.resize(8);  // the goal's line type is the ninth
      labels.emplace_back("goal");
    }
    return labels;
  }

  std::string caption(const PolicyRows& rows, const View& view, bool has_goal) const override {
    return fmt::format(
        "{} of the best roll-out of all repetitions{}; in grey what learning began with.{}",
        view.is_path ? "One output over the other, to one scale," : "Output over input",
        num_mixtures(rows) > 0
            ? ", with the Gaussians of each layer (ellipses of two standard deviations)"
            : "",
        has_goal ? " The thick light line is the task's goal." : "");
  }

 private:
  /// The layers of the one that has most, of those that are mixtures.
  static int num_mixtures(const PolicyRows& rows) {
    int num_layers = 0;
    for (const auto& row : rows) {
      for (const LearntPolicy* policy : row) {
        if (!has_gaussians(after(*policy).sketch())) continue;
        num_layers = std::max(num_layers, after(*policy).num_layers());
      }
    }
    return num_layers;
  }
};

}  // namespace

std::vector<Plot> policy_plots(const std::string& study,
                               const std::vector<LearntPolicy>& policies) {
  return draw_outputs(policies, BeforeAndAfter(), "policies",
                      "Policies of " + study + " before and after learning");
}

std::vector<Plot> path_plots(const std::string& study, const std::vector<LearntPolicy>& policies) {
  return draw_paths(policies, BeforeAndAfter(), "paths",
                    "Paths of " + study + " before and after learning");
}

}  // namespace treeroll::report
