#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "learner/report/figures/policy_figure.h"
#include "learner/report/figures/policy_plot.h"

namespace treeroll::report {
namespace {

/// More lines are one blot.
constexpr std::size_t kSolutionsMax = 200;

/// What every repetition has found.
class Solutions : public PolicyFigure {
 public:
  std::string line_types() const override {
    return "  set linetype 1 lc rgb '#D55E00' lw .7 dt 1\n"
           "  set linetype 2 lc rgb '#000000' lw 3 dt 1\n"
           "  set linetype 3 lc rgb '#888888' lw 2 dt (6,4)\n";
  }
  std::string goal_style() const override { return "lt 2"; }
  std::string panel_title(const LearntPolicy& policy) const override {
    return fmt::format("{} ({})", policy.condition, num_shown(policy));
  }
  std::string input_range(const LearntPolicy& /*policy*/) const override { return "[*:*]"; }

  std::string lines(const LearntPolicy& policy, const View& view, const std::string& goal,
                    DataSets& data) const override {
    const Range drawn = inputs_of(policy);
    std::vector<PolicySketch::Layer> finest;
    for (std::size_t i = 0; i < num_shown(policy); ++i) {
      PolicySketch sketch = policy.solutions[i]->sketch();
      finest.push_back(std::move(sketch.layers.back()));
    }
    return curves(finest, view.plane, drawn, "lt 1", data) + ", " + goal +
           curve(policy.start->sketch().layers.back(), view.plane, drawn, "lt 3", data);
  }

  std::vector<std::string> labels(const PolicyRows& /*rows*/, bool has_goal) const override {
    return {"best of each repetition", has_goal ? "goal" : "", "start"};
  }

  std::string caption(const PolicyRows& rows, const View& view, bool has_goal) const override {
    bool is_cut = false;
    for (const auto& row : rows) {
      for (const LearntPolicy* policy : row) {
        is_cut = is_cut || policy->solutions.size() > kSolutionsMax;
      }
    }
    return fmt::format(
        "What the repetitions have found: {} of the policy of each one's best roll-out{}; in grey "
        "what learning began with. In brackets how many are drawn{}.",
        view.is_path ? "the path, to one scale," : "output over input",
        has_goal ? ", with the task's goal in black" : "", is_cut ? ", the first of more" : "");
  }

 private:
  static std::size_t num_shown(const LearntPolicy& policy) {
    return std::min(policy.solutions.size(), kSolutionsMax);
  }
};

}  // namespace

std::vector<Plot> solution_plots(const std::string& study,
                                 const std::vector<LearntPolicy>& policies) {
  std::vector<LearntPolicy> solved;
  std::copy_if(policies.begin(), policies.end(), std::back_inserter(solved),
               [](const LearntPolicy& policy) { return !policy.solutions.empty(); });
  std::vector<Plot> plots =
      draw_outputs(solved, Solutions(), "solutions", "Solutions of all repetitions of " + study);
  std::vector<Plot> paths =
      draw_paths(solved, Solutions(), "solution_paths", "Paths of all repetitions of " + study);
  std::move(paths.begin(), paths.end(), std::back_inserter(plots));
  return plots;
}

}  // namespace treeroll::report
