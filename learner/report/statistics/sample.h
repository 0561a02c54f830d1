#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "learner/report/statistics/measure.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// A measure of every repetition of a condition.
struct Sample {
  std::string label;                          ///< the condition
  std::vector<std::optional<double>> values;  ///< by repetition; nothing where a run lacks it
  /// They are one number, said once for each repetition: that of the fit that all begin with. It is
  /// certain, and its repetitions are no evidence.
  bool is_of_fit = false;

  /// Those that are there.
  std::vector<double> present() const;
};

/// The runs of one condition, by repetition; empty if there is none of this name.
std::vector<MeasuredRun> runs_of(const StudyResults& study, std::string_view condition);

/// For captions: " Runs that were done before ..." if some go on with the reward that they ended
/// with; else empty.
std::string caption_of_runs_that_go_on(const StudyResults& study);

/// Its conditions in the study's order.
std::vector<std::string> conditions_of(const StudyResults& study);

struct ConditionName {
  std::string study;
  std::string condition;
};
/// @param condition  CONDITION of `study`, or STUDY:CONDITION
ConditionName parse_condition(const std::string& study, const std::string& condition);

/// @param condition  CONDITION of `study`, or STUDY:CONDITION
/// @param measure    kLogLikelihood is the same for every repetition: the start is
/// @return           an error that says which study or condition is not there
Result<Sample> find_sample(const std::vector<StudyResults>& studies, const std::string& study,
                           const std::string& condition, const Measure& measure);

/// The values of those repetitions that both have.
std::pair<std::vector<double>, std::vector<double>> pairs(const Sample& a, const Sample& b);

}  // namespace treeroll::report
