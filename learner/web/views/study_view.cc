// What does not change while a study is learnt, and the curves of its conditions.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "learner/web/views/policy_view.h"
#include "learner/web/views/view_text.h"
#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

using nlohmann::json;

/// "mean":[0.1,0.25,null]: four digits are more than a screen shows.
template <class Get>
void append(std::string& text, const char* name, const std::vector<RewardCurves::Point>& points,
            const Get& get) {
  fmt::format_to(std::back_inserter(text), ",\"{}\":[", name);
  bool is_first = true;
  for (const RewardCurves::Point& point : points) {
    if (!is_first) text += ',';
    is_first = false;
    const double value = get(point);
    if (point.num_runs == 0 || !std::isfinite(value)) {  // JSON has no word for these
      text += "null";
    } else {
      fmt::format_to(std::back_inserter(text), "{:.5g}", value);
    }
  }
  text += ']';
}

}  // namespace

std::string study_view(const LiveStudy& study) {
  const Study& what = study.core().study();
  const StudyFacts& facts = study.facts();
  json view{{"name", what.name},
            {"program", facts.program},
            {"incarnation", facts.incarnation},
            {"directory", facts.directory},
            {"is_replay", facts.is_replay},
            {"repetitions", what.repetitions},
            {"final_evaluations", what.final_evaluations},
            {"seed", std::to_string(what.seed)},
            {"conditions", json::array()}};
  for (const Condition& condition : what.conditions) {
    const json task = json::parse(condition.task_content);
    view["conditions"].push_back({{"name", condition.name},
                                  {"task", task.value("name", "")},
                                  {"policy", condition.start->kind()},
                                  {"layers", condition.start->num_layers()},
                                  {"theta_dim", condition.start->theta_dim()},
                                  {"rollouts", condition.exploration.num_rollouts}});
  }
  return dumped(view);
}

std::string curves_view(LiveStudy& study) {
  std::string text = "{\"incarnation\":" + json(study.facts().incarnation).dump() +
                     fmt::format(",\"version\":{},\"conditions\":[", study.version());
  bool is_first = true;
  for (RewardCurves& curves : study.curves()) {
    const std::vector<RewardCurves::Point>& points = curves.points();
    fmt::format_to(std::back_inserter(text), "{}{{\"rollouts_per_point\":{},\"rollout\":[",
                   is_first ? "" : ",", curves.rollouts_per_point());
    is_first = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      fmt::format_to(std::back_inserter(text), "{}{:g}", i == 0 ? "" : ",", points[i].rollout);
    }
    text += ']';
    using Point = RewardCurves::Point;
    append(text, "runs", points,
           [](const Point& point) { return static_cast<double>(point.num_runs); });
    append(text, "mean", points, [](const Point& point) { return point.mean; });
    append(text, "low", points, [](const Point& point) { return point.lower_quartile; });
    append(text, "median", points, [](const Point& point) { return point.median; });
    append(text, "high", points, [](const Point& point) { return point.upper_quartile; });
    append(text, "best", points, [](const Point& point) { return point.best; });
    text += '}';
  }
  return text + "]}";
}

std::string condition_view(const LiveStudy& study, int condition) {
  const auto place = static_cast<std::size_t>(condition);
  const StudyFacts& facts = study.facts();
  const Condition& known = study.core().study().conditions[place];
  json view{{"policy", policy_view(*known.start)},
            {"columns", all_of(known.signals)},
            {"demonstration", nullptr}};
  if (known.signals.empty() && place < facts.columns.size()) view["columns"] = facts.columns[place];
  if (place < facts.demonstrations.size() && facts.demonstrations[place]) {
    view["demonstration"] = samples_view(*facts.demonstrations[place]);
  }
  return dumped(view);
}

}  // namespace treeroll::web
