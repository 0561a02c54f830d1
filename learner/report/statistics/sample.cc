#include "learner/report/statistics/sample.h"

#include <algorithm>
#include <cstddef>

namespace treeroll::report {

std::vector<double> Sample::present() const {
  std::vector<double> found;
  for (const auto& value : values) {
    if (value) found.push_back(*value);
  }
  return found;
}

std::vector<MeasuredRun> runs_of(const StudyResults& study, std::string_view condition) {
  const auto found = study.endings.find(std::string(condition));
  const RunEnding ending = found == study.endings.end() ? RunEnding{} : found->second;
  std::vector<MeasuredRun> runs;
  for (const RunRecord& run : study.runs) {
    if (run.condition == condition) runs.emplace_back(run, ending);
  }
  return runs;
}

std::string caption_of_runs_that_go_on(const StudyResults& study) {
  for (const std::string& condition : conditions_of(study)) {
    if (std::ranges::any_of(runs_of(study, condition), &MeasuredRun::goes_on)) {
      return " Runs that were done before the end of their budget go on to it with the reward that "
             "they ended with.";
    }
  }
  return "";
}

std::vector<std::string> conditions_of(const StudyResults& study) {
  std::vector<std::string> names;
  for (const RunRecord& run : study.runs) {
    if (names.empty() || names.back() != run.condition) names.push_back(run.condition);
  }
  return names;
}

ConditionName parse_condition(const std::string& study, const std::string& condition) {
  const std::size_t colon = condition.find(':');
  if (colon == std::string::npos) return {study, condition};
  return {condition.substr(0, colon), condition.substr(colon + 1)};
}

Result<Sample> find_sample(const std::vector<StudyResults>& studies, const std::string& study,
                           const std::string& condition, const Measure& wanted) {
  const ConditionName place = parse_condition(study, condition);
  const auto& [study_name, name] = place;
  const auto found = std::find_if(studies.begin(), studies.end(), [&](const StudyResults& results) {
    return results.name == place.study;
  });
  if (found == studies.end()) return Error{"study " + study_name + " is not among those given"};
  Sample sample{.label = name, .values = {}};
  const auto fit = found->log_likelihoods.find(name);
  sample.is_of_fit =
      wanted.kind == MeasureKind::kLogLikelihood && fit != found->log_likelihoods.end();
  for (const MeasuredRun& run : runs_of(*found, name)) {
    sample.values.push_back(sample.is_of_fit ? fit->second : measure(run, wanted));
  }
  if (sample.values.empty()) return Error{"study " + study_name + " has no condition " + name};
  return sample;
}

std::pair<std::vector<double>, std::vector<double>> pairs(const Sample& a, const Sample& b) {
  std::pair<std::vector<double>, std::vector<double>> both;
  for (std::size_t i = 0; i < std::min(a.values.size(), b.values.size()); ++i) {
    if (!a.values[i] || !b.values[i]) continue;
    both.first.push_back(*a.values[i]);
    both.second.push_back(*b.values[i]);
  }
  return both;
}

}  // namespace treeroll::report
