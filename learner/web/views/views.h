#pragma once

#include <optional>
#include <string>

#include "learner/web/views/live_study.h"

/// What a page asks of a study, as JSON. Every text is bounded, whatever the study's size; numbers
/// that are not finite are null; ids of workers and learners are text, since they are larger than
/// what a browser's numbers hold.
namespace treeroll::web {

/// What does not change: names, sizes, conditions.
std::string study_view(const LiveStudy& study);

/// What changes: progress, ledger, conditions, workers, failures.
std::string state_view(const LiveStudy& study, TimePoint now);

/// Learning curves of all conditions.
std::string curves_view(LiveStudy& study);

/// How a condition begins: its policy, its demonstration.
/// Precondition: there is such a condition.
std::string condition_view(const LiveStudy& study, int condition);

struct RunsQuery {
  std::optional<int> condition;
  std::string order = "run";  ///< or "best", "worst": by the best reward; "failed"
  int from = 0;               ///< rows to leave out
};
/// A table of runs, a page of it.
std::string runs_view(const LiveStudy& study, const RunsQuery& query);

/// One run: its rewards over roll-outs, layers, switches, failures, its policy now with the noise.
/// Precondition: there is such a run.
std::string run_view(const LiveStudy& study, int run);

struct RolloutsQuery {
  std::optional<int> condition;
  std::optional<int> run;
  std::optional<int> layer;
  std::string status;  ///< "": any; "failed": any but ok; or a status by its name
  double reward_min = 0;
  std::string order = "newest";  ///< or "number": by run and number
  /// "RUN:NUMBER", where to go on; empty: from the begin. For order "number".
  std::string from;
};
/// A table of roll-outs, a page of it. In order "newest" only the last ones that were applied are
/// looked at: "last" says how many if there may be more, "is_cut" whether more of these fit.
std::string rollouts_view(const LiveStudy& study, const RolloutsQuery& query);

/// For Prometheus, in its text format.
std::string metrics_view(const LiveStudy& study, TimePoint now);

}  // namespace treeroll::web
